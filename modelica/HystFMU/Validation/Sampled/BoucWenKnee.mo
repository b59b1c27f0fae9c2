// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation.Sampled;
model BoucWenKnee "Bouc-Wen operator with a sharp knee, sampled"
  extends Icons.Example;
  Operators.Sampled.BoucWen tested(A = 2, beta = 2.5, gamma = 0.8, n = 2.5, alpha = 0.3, u0 = -0.4, Ts = 0.004) annotation (Placement(transformation(extent = {{10, -20}, {50, 20}})));
  BaseClasses.TestSignal signal(amplitude = 1, offset = 0) annotation (Placement(transformation(extent = {{-70, -20}, {-30, 20}})));
equation
  connect(signal.r, tested.u) annotation (Line(points = {{-28, 0}, {8, 0}}, color = {0, 0, 127}));
  annotation (experiment(StopTime = 1.4, Interval = 0.004, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Bouc-Wen operator with a sharp knee. The test compares it with the unit on the signal of <a href=\"modelica://HystFMU.Validation.BaseClasses.TestSignal\">Validation.BaseClasses.TestSignal</a>, at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.BoucWen\">Operators.Sampled.BoucWen</a>.</p>
</html>"));
end BoucWenKnee;
