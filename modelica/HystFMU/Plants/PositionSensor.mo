within HystFMU.Plants;
model PositionSensor "Position of a flange as a signal"
  extends Icons.Component;
  Interfaces.Flange flange "Flange whose position is measured, without force" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput s(unit = "m") "Position" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
equation
  flange.f = 0;
  s = flange.s;
  annotation (
    Icon(graphics = {Line(points = {{-100, 0}, {-70, 0}}, color = {0, 127, 0}), Line(points = {{70, 0}, {100, 0}}, color = {0, 0, 127}), Text(extent = {{-70, -40}, {70, 40}}, textString = "s")}),
    Documentation(info = "<html>
<p><b>Equation:</b> f = 0; the output is the position.</p>
<p><b>Source:</b> definition.</p>
<p><b>Limitations:</b> ideal sensor without noise and bandwidth limit.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.StackInLoop\">Examples.StackInLoop</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Plants.SpringMassLoad\">Plants.SpringMassLoad</a>.</p>
</html>"));
end PositionSensor;
