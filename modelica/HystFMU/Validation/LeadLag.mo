// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model LeadLag "Lead-lag controller of two sections with limits"
  extends Icons.Example;
  Control.LeadLag tested(n = 2, K = 0.8, T_z = {0.02, 4e-3}, T_p = {4e-3, 0.03}, u_min = -0.9, u_max = 0.8, Ts = 1e-3) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.y_d = sin(20*time);
  tested.y = 0.9*sin(20*time - 0.1) + 0.05;
  tested.u_ff = 1.1*sin(20*time);
  annotation (experiment(StopTime = 1, Interval = 0.001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Lead-lag controller of two sections with limits. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.LeadLag\">Control.LeadLag</a>.</p>
</html>"));
end LeadLag;
