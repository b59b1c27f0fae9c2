within HystFMU.Validation;
model LeadLag "Lead-lag controller of two sections with limits"
  extends Icons.Example;
  Control.LeadLag tested(n = 2, K = 0.8, T_z = {0.02, 4e-3}, T_p = {4e-3, 0.03}, u_min = -0.9, u_max = 0.8, Ts = 1e-3);
equation
  tested.y_d = sin(20*time);
  tested.y = 0.9*sin(20*time - 0.1) + 0.05;
  tested.u_ff = 1.1*sin(20*time);
  annotation (
    experiment(StopTime = 1.0, Interval = 0.001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Lead-lag controller of two sections with limits; the test holds it against the unit of the same name at every sample.</p>
</html>"));
end LeadLag;
