// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model Differentiator "Filtered derivative"
  extends Icons.Example;
  Dynamics.Differentiator tested(tau = 0.02, Ts = 0.01) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.u = sin(7*time) + 0.3*cos(23*time);
  annotation (experiment(StopTime = 1.1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Filtered derivative. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.Differentiator\">Dynamics.Differentiator</a>.</p>
</html>"));
end Differentiator;
