// generated from tests/vectors/derived/coleman_hodgdon.toml by `make generate` - do not edit
within HystFMU.Validation.Sampled;
model ColemanHodgdon "Coleman-Hodgdon operator, values of its first vector, sampled"
  extends Icons.Example;
  Operators.Sampled.ColemanHodgdon tested(alpha = 1, b = 1, k = 0.6, Ts = 0.002) annotation (Placement(transformation(extent = {{10, -20}, {50, 20}})));
  BaseClasses.TestSignal signal(amplitude = 2, offset = 0) annotation (Placement(transformation(extent = {{-70, -20}, {-30, 20}})));
equation
  connect(signal.r, tested.u) annotation (Line(points = {{-28, 0}, {8, 0}}, color = {0, 0, 127}));
  annotation (experiment(StopTime = 1.4, Interval = 0.002, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Coleman-Hodgdon operator, values of its first vector. The test compares it with the unit on the signal of <a href=\"modelica://HystFMU.Validation.BaseClasses.TestSignal\">Validation.BaseClasses.TestSignal</a>, at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.ColemanHodgdon\">Operators.Sampled.ColemanHodgdon</a>.</p>
</html>"));
end ColemanHodgdon;
