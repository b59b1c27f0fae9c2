// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model Multisine "Sum of sines with derivatives and preview"
  extends Icons.Example;
  Sources.Multisine tested(m = 3, amplitude = 1.5, offset = 0.2, f = {1, 2.5, 7}, a = {0.5, 0.3, -0.2}, ph = {0.1, 0, 2}, lead = 0.003) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
  annotation (experiment(StopTime = 1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Sum of sines with derivatives and preview. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.Multisine\">Sources.Multisine</a>.</p>
</html>"));
end Multisine;
