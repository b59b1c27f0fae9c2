within HystFMU.Validation.Sampled;
model ImplicitInverse "Inverse.Sampled.ImplicitInverse of a weighted sum of plays with several signals"
  extends Icons.Example;
  BaseClasses.TestSignal signal(amplitude = 1.1, offset = 0.1) annotation (Placement(transformation(extent = {{-70, -20}, {-30, 20}})));
  Inverse.Sampled.ImplicitInverse tested(lo = -1.5, hi = 1, values = {0.5, 0.1, 0.3, 0.6, 0.4, 0.3, 0.2}, state0 = {0, 0, 0, 0}, Ts = 4e-3) "Three plays: w0, r, w" annotation (Placement(transformation(extent = {{10, -20}, {50, 20}})));
equation
  connect(signal.r, tested.y) annotation (Line(points = {{-28, 0}, {8, 0}}, color = {0, 0, 127}));
  annotation (
    experiment(StopTime = 1.4, Interval = 0.004, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Inverse.Sampled.ImplicitInverse of a weighted sum of plays on sine, minor loops, decaying sine, ramp and hold, steps, noise at the reversal; beyond the upper limit, too.</p>
</html>"));
end ImplicitInverse;
