// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation.Sampled;
model PreisachLow "Preisach operator from negative saturation, sampled"
  extends Icons.Example;
  Operators.Sampled.Preisach tested(n = 4, depth = 32, lo = -1.1, hi = 1.05, E = {0.3, 0.7, 0.25, 1.1, 0.6, 0.2, 1.3, 0.9, 0.5, 0.15}, start = Types.Magnetisation.low, Ts = 0.002) annotation (Placement(transformation(extent = {{10, -20}, {50, 20}})));
  BaseClasses.TestSignal signal(amplitude = 1, offset = 0) annotation (Placement(transformation(extent = {{-70, -20}, {-30, 20}})));
equation
  connect(signal.r, tested.u) annotation (Line(points = {{-28, 0}, {8, 0}}, color = {0, 0, 127}));
  annotation (experiment(StopTime = 1.4, Interval = 0.002, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Preisach operator from negative saturation. The test compares it with the unit on the signal of <a href=\"modelica://HystFMU.Validation.BaseClasses.TestSignal\">Validation.BaseClasses.TestSignal</a>, at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.Preisach\">Operators.Sampled.Preisach</a>.</p>
</html>"));
end PreisachLow;
