// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model Sum "Weighted sum of three signals"
  extends Icons.Example;
  Dynamics.Sum tested(n = 3, k = {1, -2, 0.5}, offset = 0.3) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.u[1] = sin(7*time);
  tested.u[2] = cos(5*time);
  tested.u[3] = time;
  annotation (experiment(StopTime = 1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Weighted sum of three signals. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.Sum\">Dynamics.Sum</a>.</p>
</html>"));
end Sum;
