// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model Quantiser "Quantiser with a level beside 0"
  extends Icons.Example;
  Dynamics.Quantiser tested(q = 0.3, offset = 0.1) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.u = 2*sin(7*time);
  annotation (experiment(StopTime = 1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Quantiser with a level beside 0. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.Quantiser\">Dynamics.Quantiser</a>.</p>
</html>"));
end Quantiser;
