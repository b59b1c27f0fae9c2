// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model RandomReversals "Random nested reversals with derivatives and preview"
  extends Icons.Example;
  Sources.RandomReversals tested(m = 6, amplitude = 1.2, offset = 0.1, frequency = 3.3, seed = 7, lead = 0.003) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
  annotation (experiment(StopTime = 1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Random nested reversals with derivatives and preview. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.RandomReversals\">Sources.RandomReversals</a>.</p>
</html>"));
end RandomReversals;
