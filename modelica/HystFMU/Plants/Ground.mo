within HystFMU.Plants;
model Ground "Potential 0"
  extends Icons.Component;
  Interfaces.Pin pin "Potential 0" annotation (Placement(transformation(extent = {{-10, 100}, {10, 120}})));
equation
  pin.v = 0;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> v = 0.</p>
<p><b>Source:</b> definition.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.StackMovesMass\">Examples.StackMovesMass</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.Stack\">Actuators.Stack</a>.</p>
</html>"));
end Ground;
