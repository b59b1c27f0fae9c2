within HystFMU.Validation;
model DisturbanceObserver "Disturbance observer with limits"
  extends Icons.Example;
  Control.DisturbanceObserver tested(f_n = 60, zeta = 0.3, gain = 1.5, f_o = 25, u_min = -0.9, u_max = 0.8, Ts = 1e-3);
equation
  tested.u_c = sin(20*time);
  tested.y = 1.2*sin(20*time - 0.1) + 0.05;
  annotation (
    experiment(StopTime = 1.0, Interval = 0.001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Disturbance observer with limits; the test holds it against the unit of the same name at every sample.</p>
</html>"));
end DisturbanceObserver;
