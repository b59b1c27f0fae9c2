// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model TriangleRounded "Triangle reference with turn-arounds over a fifth of the period"
  extends Icons.Example;
  Sources.Triangle tested(amplitude = 1.5, offset = 0.2, frequency = 2.3, phase = 0.4, turn = 0.2, lead = 0.003) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
  annotation (experiment(StopTime = 1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Triangle reference with turn-arounds over a fifth of the period. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.Triangle\">Sources.Triangle</a>.</p>
</html>"));
end TriangleRounded;
