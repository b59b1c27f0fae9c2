// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model SuperTwisting "Super-twisting controller with linear terms, filter and limits"
  extends Icons.Example;
  Control.SuperTwisting tested(lam = 50, k_1 = 0.02, k_2 = 0.5, mu = 0.3, epsilon = 2, tau = 2e-3, u_min = -0.9, u_max = 0.8, Ts = 1e-3) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.y_d = sin(20*time);
  tested.y = 0.9*sin(20*time - 0.1) + 0.05;
  tested.u_ff = 1.1*sin(20*time);
  annotation (experiment(StopTime = 1, Interval = 0.001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Super-twisting controller with linear terms, filter and limits. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.SuperTwisting\">Control.SuperTwisting</a>.</p>
</html>"));
end SuperTwisting;
