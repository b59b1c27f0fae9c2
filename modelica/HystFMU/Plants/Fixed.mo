within HystFMU.Plants;
model Fixed "Flange that does not move"
  extends Icons.Component;
  Interfaces.Flange flange "Fixed flange" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  parameter Types.Position s0 = 0 "Where" annotation (Dialog(group = "Start"));
equation
  flange.s = s0;
  annotation (
    Icon(graphics = {Line(points = {{-60, -40}, {-30, 40}}, color = {0, 127, 0}), Line(points = {{-30, -40}, {0, 40}}, color = {0, 127, 0}), Line(points = {{0, -40}, {30, 40}}, color = {0, 127, 0}), Line(points = {{30, -40}, {60, 40}}, color = {0, 127, 0})}),
    Documentation(info = "<html>
<p><b>Equation:</b> s = s0.</p>
<p><b>Source:</b> definition.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.StackMovesMass\">Examples.StackMovesMass</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.Stack\">Actuators.Stack</a>.</p>
</html>"));
end Fixed;
