// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation.Smooth;
model BoucWen "Bouc-Wen operator in closed form, smooth"
  extends Icons.Example;
  Operators.Smooth.BoucWen tested(A = 1.2, beta = 0.9, gamma = -0.3, alpha = 0.2, k = 1.5, z0 = 0.1, u0 = 0.3) annotation (Placement(transformation(extent = {{10, -20}, {50, 20}})));
  BaseClasses.TestSignal signal(amplitude = 1, offset = 0) annotation (Placement(transformation(extent = {{-70, -20}, {-30, 20}})));
equation
  connect(signal.r, tested.u) annotation (Line(points = {{-28, 0}, {8, 0}}, color = {0, 0, 127}));
  connect(signal.dr, tested.du) annotation (Line(points = {{-28, -14}, {8, -14}}, color = {0, 0, 127}));
  annotation (experiment(StopTime = 1.4, Interval = 0.001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Bouc-Wen operator in closed form. The test compares it with the unit on the signal of <a href=\"modelica://HystFMU.Validation.BaseClasses.TestSignal\">Validation.BaseClasses.TestSignal</a>, at every row of the simulation.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Smooth.BoucWen\">Operators.Smooth.BoucWen</a>.</p>
</html>"));
end BoucWen;
