// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation.Events;
model ConstraintFactorInverse "Inverse of a constraint-factor operator, beyond d_max too, events"
  extends Icons.Example;
  Inverse.Events.ConstraintFactorInverse tested(m = 2, depth = 32, a0 = 0.5, a = {1, 0.05}, d_max = 1.5, x0 = -0.1) annotation (Placement(transformation(extent = {{10, -20}, {50, 20}})));
  BaseClasses.TestSignal signal(amplitude = 0.9, offset = 0) annotation (Placement(transformation(extent = {{-70, -20}, {-30, 20}})));
equation
  connect(signal.r, tested.h) annotation (Line(points = {{-28, 0}, {8, 0}}, color = {0, 0, 127}));
  connect(signal.dr, tested.dh) annotation (Line(points = {{-28, -14}, {8, -14}}, color = {0, 0, 127}));
  annotation (experiment(StopTime = 1.4, Interval = 0.002, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Inverse of a constraint-factor operator, beyond d_max too. The test compares it with the unit on the signal of <a href=\"modelica://HystFMU.Validation.BaseClasses.TestSignal\">Validation.BaseClasses.TestSignal</a>, at every row of the simulation.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Events.ConstraintFactorInverse\">Inverse.Events.ConstraintFactorInverse</a>.</p>
</html>"));
end ConstraintFactorInverse;
