// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model Disturbance "Step plus sine"
  extends Icons.Example;
  Sources.Disturbance tested(step = 0.5, t_step = 0.305, amplitude = 0.2, frequency = 3, phase = 0.4) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
  annotation (experiment(StopTime = 1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Step plus sine. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.Disturbance\">Sources.Disturbance</a>.</p>
</html>"));
end Disturbance;
