within HystFMU;
package Actuators "Piezoelectric and magnetostrictive actuators with pins and flanges, and their drives"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>In a stack, a bender and a magnetostrictive rod, the component <code>hysteresis</code> is replaceable by any identified static model that extends BaseClasses.Hysteresis. Pins, flanges and heat ports have the same quantities as those of the Modelica Standard Library and can be connected to them.</p>
</html>"));
end Actuators;
