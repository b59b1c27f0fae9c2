// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model SlidingModeSaturation "Sliding mode controller with the saturated switching term"
  extends Icons.Example;
  Control.SlidingMode tested(lam = 50, eta = 2e-3, rho = 0.1, epsilon = 5, switching = Types.Switching.saturation, k_i = 3000, tau = 2e-3, u_min = -0.9, u_max = 0.8, Ts = 1e-3) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.y_d = sin(20*time);
  tested.y = 0.9*sin(20*time - 0.1) + 0.05;
  tested.u_ff = 1.1*sin(20*time);
  annotation (experiment(StopTime = 1, Interval = 0.001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Sliding mode controller with the saturated switching term. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.SlidingMode\">Control.SlidingMode</a>.</p>
</html>"));
end SlidingModeSaturation;
