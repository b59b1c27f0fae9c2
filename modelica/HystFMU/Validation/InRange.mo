// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model InRange "Two signals, the second with a lower limit only"
  extends Icons.Example;
  Dynamics.InRange tested(n = 2, lo = {-0.5, -0.4}, hi = {0.7, 1e300}) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.u[1] = sin(7*time);
  tested.u[2] = cos(5*time);
  annotation (experiment(StopTime = 1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Two signals, the second with a lower limit only. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.InRange\">Dynamics.InRange</a>.</p>
</html>"));
end InRange;
