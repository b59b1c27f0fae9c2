// generated from tests/vectors/derived/creep_inverse.toml by `make generate` - do not edit
within HystFMU.Validation.Sampled;
model CreepInverse "Exact inverse of creep, values of its first vector, sampled"
  extends Icons.Example;
  Inverse.Sampled.CreepInverse tested(n = 2, w = {0.5, 0.25}, T = {0.1, 2.0}, w0 = 2, Ts = 0.002) annotation (Placement(transformation(extent = {{10, -20}, {50, 20}})));
  BaseClasses.TestSignal signal(amplitude = 6.812313432616847, offset = 0) annotation (Placement(transformation(extent = {{-70, -20}, {-30, 20}})));
equation
  connect(signal.r, tested.u) annotation (Line(points = {{-28, 0}, {8, 0}}, color = {0, 0, 127}));
  annotation (experiment(StopTime = 1.4, Interval = 0.002, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Exact inverse of creep, values of its first vector. The test compares it with the unit on the signal of <a href=\"modelica://HystFMU.Validation.BaseClasses.TestSignal\">Validation.BaseClasses.TestSignal</a>, at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Sampled.CreepInverse\">Inverse.Sampled.CreepInverse</a>.</p>
</html>"));
end CreepInverse;
