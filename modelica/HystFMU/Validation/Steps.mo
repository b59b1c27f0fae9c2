// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model Steps "Levels one after the other"
  extends Icons.Example;
  Sources.Steps tested(m = 4, amplitude = 2, levels = {0.1, 0.5, -0.4, 0.8}, T = 0.2101, lead = 0.05) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
  annotation (experiment(StopTime = 1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Levels one after the other. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.Steps\">Sources.Steps</a>.</p>
</html>"));
end Steps;
