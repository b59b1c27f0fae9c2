within HystFMU;
package Loops "Closed loops to fill: plant, inverse and controller in slots"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Extend <a href=\"modelica://HystFMU.Loops.Tracking\">Loops.Tracking</a>, redeclare plant, inverse and controller, simulate. The other
classes of the package stand in its slots.</p>
</html>"));
end Loops;
