// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation.Sampled;
model StopBank "Three stops, sampled"
  extends Icons.Example;
  Operators.Sampled.StopBank tested(n = 3, r = {0.2, 0.4, 0.8}, z0 = {0.1, 0, -0.4}, Ts = 0.002) annotation (Placement(transformation(extent = {{10, -20}, {50, 20}})));
  BaseClasses.TestSignal signal(amplitude = 1, offset = 0) annotation (Placement(transformation(extent = {{-70, -20}, {-30, 20}})));
equation
  connect(signal.r, tested.u) annotation (Line(points = {{-28, 0}, {8, 0}}, color = {0, 0, 127}));
  annotation (experiment(StopTime = 1.4, Interval = 0.002, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Three stops. The test compares it with the unit on the signal of <a href=\"modelica://HystFMU.Validation.BaseClasses.TestSignal\">Validation.BaseClasses.TestSignal</a>, at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.StopBank\">Operators.Sampled.StopBank</a>.</p>
</html>"));
end StopBank;
