// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model DisturbanceObserver "Disturbance observer with a known delay and limits"
  extends Icons.Example;
  Control.DisturbanceObserver tested(n = 2, f_n = 60, zeta = 0.3, gain = 1.5, f_o = 25, u_min = -0.9, u_max = 0.8, Ts = 1e-3) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.u_c = sin(20*time);
  tested.y = 1.2*sin(20*time - 0.1) + 0.05;
  annotation (experiment(StopTime = 1, Interval = 0.001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Disturbance observer with a known delay and limits. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.DisturbanceObserver\">Control.DisturbanceObserver</a>.</p>
</html>"));
end DisturbanceObserver;
