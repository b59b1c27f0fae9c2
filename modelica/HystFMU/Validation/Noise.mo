// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model Noise "Noise with standard deviation 0.7"
  extends Icons.Example;
  Sources.Noise tested(sigma = 0.7, seed = 12345, Ts = 0.01) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
  annotation (experiment(StopTime = 1.1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Noise with standard deviation 0.7. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.Noise\">Sources.Noise</a>.</p>
</html>"));
end Noise;
