within HystFMU;
package Actuators "Piezoelectric and magnetostrictive actuators between pins and flanges, and what drives and moves with them"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>A stack, a bender or a magnetostrictive rod takes any identified static model in its slot <code>hysteresis</code>, which BaseClasses.Hysteresis constrains. Pins, flanges and heat ports have the quantities of the Modelica Standard Library and connect to its parts.</p>
</html>"));
end Actuators;
