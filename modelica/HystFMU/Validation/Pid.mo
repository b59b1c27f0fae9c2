// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model Pid "PID controller with filter and limits"
  extends Icons.Example;
  Control.Pid tested(Kp = 0.8, Ki = 20, Kd = 3e-3, tau = 2e-3, u_min = -0.9, u_max = 0.8, Ts = 1e-3) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.y_d = sin(20*time);
  tested.y = 0.9*sin(20*time - 0.1) + 0.05;
  tested.u_ff = 1.1*sin(20*time);
  annotation (experiment(StopTime = 1, Interval = 0.001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>PID controller with filter and limits. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.Pid\">Control.Pid</a>.</p>
</html>"));
end Pid;
