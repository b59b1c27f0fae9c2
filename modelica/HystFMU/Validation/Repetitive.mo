// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model Repetitive "Repetitive control over four periods, with both filters and a stretch that is not learnt"
  extends Icons.Example;
  Control.Repetitive tested(n = 40, n_q = 2, n_l = 3, q = {0.4, 0.2, 0.09}, l = {0.01, -0.03, 0.1, 0.3, 0.12, 0.05, -0.02}, Ts = 1e-3) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.y_d = sin(157.07963267948966*time);
  tested.y = 0.9*sin(157.07963267948966*time - 0.1) + 0.05;
  tested.active = if time > 0.0605 and time < 0.0755 then 0 else 1;
  annotation (experiment(StopTime = 0.17, Interval = 0.001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Repetitive control over four periods, with both filters and a stretch that is not learnt. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.Repetitive\">Control.Repetitive</a>.</p>
</html>"));
end Repetitive;
