within HystFMU;
package Loops "Closed loops with replaceable plant, inverse and controller"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Extend <a href=\"modelica://HystFMU.Loops.Tracking\">Loops.Tracking</a>, redeclare plant, inverse and controller, and
simulate. The other classes of the package are such plants, inverses and controllers.</p>
</html>"));
end Loops;
