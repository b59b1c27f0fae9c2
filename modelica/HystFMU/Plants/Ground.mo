within HystFMU.Plants;
model Ground "Potential 0"
  extends Icons.Component;
  Interfaces.Pin pin "Potential 0" annotation (Placement(transformation(extent = {{-10, 100}, {10, 120}})));
equation
  pin.v = 0;
  annotation (
    Icon(graphics = {Line(points = {{-50, 10}, {50, 10}}, color = {0, 0, 255}), Line(points = {{-32, -10}, {32, -10}}, color = {0, 0, 255}), Line(points = {{-14, -30}, {14, -30}}, color = {0, 0, 255})}),
    Documentation(info = "<html>
<p><b>Equation:</b> v = 0.</p>
<p><b>Source:</b> definition.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.StackMovesMass\">Examples.StackMovesMass</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.Stack\">Actuators.Stack</a>.</p>
</html>"));
end Ground;
