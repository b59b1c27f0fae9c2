// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation.Events;
model BacklashSum "Ten plays and a linear term, events"
  extends Icons.Example;
  Operators.Events.BacklashSum tested(n = 10, w0 = 3, r = linspace(0.05, 0.5, 10), w = fill(1.0, 10), z0 = linspace(-0.2, 0.2, 10)) annotation (Placement(transformation(extent = {{10, -20}, {50, 20}})));
  BaseClasses.TestSignal signal(amplitude = 1, offset = 0) annotation (Placement(transformation(extent = {{-70, -20}, {-30, 20}})));
equation
  connect(signal.r, tested.u) annotation (Line(points = {{-28, 0}, {8, 0}}, color = {0, 0, 127}));
  connect(signal.dr, tested.du) annotation (Line(points = {{-28, -14}, {8, -14}}, color = {0, 0, 127}));
  annotation (experiment(StopTime = 1.4, Interval = 0.002, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Ten plays and a linear term. The test compares it with the unit on the signal of <a href=\"modelica://HystFMU.Validation.BaseClasses.TestSignal\">Validation.BaseClasses.TestSignal</a>, at every row of the simulation.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Events.BacklashSum\">Operators.Events.BacklashSum</a>.</p>
</html>"));
end BacklashSum;
