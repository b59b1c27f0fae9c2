// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model RateFilter "Lag of a sine and its rate"
  extends Icons.Example;
  Dynamics.RateFilter tested(T = 0.05) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.u = sin(7*time);
  annotation (experiment(StopTime = 1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Lag of a sine and its rate. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.RateFilter\">Dynamics.RateFilter</a>.</p>
</html>"));
end RateFilter;
