// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model Scaling "Two scaled signals with limits"
  extends Icons.Example;
  Dynamics.Scaling tested(n = 2, gain = {2, -0.5}, offset = {0.1, 3}, lo = {-1e300, -0.4}, hi = {0.7, 1e300}) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.u[1] = sin(7*time);
  tested.u[2] = cos(5*time);
  annotation (experiment(StopTime = 1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Two scaled signals with limits. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.Scaling\">Dynamics.Scaling</a>.</p>
</html>"));
end Scaling;
