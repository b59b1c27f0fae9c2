// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model AdaptiveInverse "Adaptive inverse behind dynamics and a delay, with a sudden change, limits and a stretch at rest"
  extends Icons.Example;
  Inverse.AdaptiveInverse tested(n = 3, delay = 2, w0 = 0.4, r = {0.05, 0.1, 0.3}, w = {0.3, 0.1, 0.5}, u0 = 0.1, f_n = 30, zeta = 0.6, f_h = 1.5, sd = {0.1, 0.08, 0.05, 0.1}, start = 0.2, T = 0.5, sigma = 0.02, change = 0.12, pause = 0.05, box = 3, w0_min = 0.25, u_min = -0.75, u_max = 0.8, Ts = 2e-3) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.v = 0.13 + 0.9*sin(20*time);
  tested.y_d = if time > 0.6005 and time < 0.7005 then 1 else sin(20*time);
  tested.y = (if time > 0.3005 then 1.3 else 1)*(0.13 + 0.8*sin(20*time - 0.2)) + 0.02*sin(170*time);
  annotation (experiment(StopTime = 1, Interval = 0.002, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Adaptive inverse behind dynamics and a delay, with a sudden change, limits and a stretch at rest. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.AdaptiveInverse\">Inverse.AdaptiveInverse</a>.</p>
</html>"));
end AdaptiveInverse;
