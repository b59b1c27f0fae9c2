// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation.Sampled;
model KrasnoselskiiPokrovskii "Six kernels, asymmetric, sampled"
  extends Icons.Example;
  Operators.Sampled.KrasnoselskiiPokrovskii tested(n = 6, a = 0.5, p1 = {-0.7, -0.5, -0.3, -0.25, 0.1, 0.2}, p2 = {-0.4, -0.5, -0.1, 0.2, 0.3, 0.4}, w = {0.1, 0.2, 0.15, 0.3, -0.05, 0.1}, offset = 0.1, k0 = {0, 0.5, -1, 1, 0.2, -0.3}, Ts = 0.002) annotation (Placement(transformation(extent = {{10, -20}, {50, 20}})));
  BaseClasses.TestSignal signal(amplitude = 1, offset = 0) annotation (Placement(transformation(extent = {{-70, -20}, {-30, 20}})));
equation
  connect(signal.r, tested.u);
  annotation (experiment(StopTime = 1.4, Interval = 0.002, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Six kernels, asymmetric. The test holds it against the unit on the signal of <a href=\"modelica://HystFMU.Validation.BaseClasses.TestSignal\">Validation.BaseClasses.TestSignal</a>, at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.KrasnoselskiiPokrovskii\">Operators.Sampled.KrasnoselskiiPokrovskii</a>.</p>
</html>"));
end KrasnoselskiiPokrovskii;
