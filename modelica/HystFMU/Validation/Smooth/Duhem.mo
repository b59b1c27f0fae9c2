// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation.Smooth;
model Duhem "Duhem operator of degrees 1 and 2, smooth"
  extends Icons.Example;
  Operators.Smooth.Duhem tested(m = 1, q = 2, k = 0.3, a_rise = {0.8, 0.1}, b_rise = {-0.5, 0.1, 0.05, -0.1}, c_rise = {-0.4, -0.2, 0, 0.1}, a_fall = {0.8, -0.1}, b_fall = {0.5, 0.1, 0.05, 0.1}, c_fall = {-0.4, 0.2, 0, 0.1}, w_max = 10, w0 = 0.05, u0 = 0.5) annotation (Placement(transformation(extent = {{10, -20}, {50, 20}})));
  BaseClasses.TestSignal signal(amplitude = 1, offset = 0) annotation (Placement(transformation(extent = {{-70, -20}, {-30, 20}})));
equation
  connect(signal.r, tested.u) annotation (Line(points = {{-28, 0}, {8, 0}}, color = {0, 0, 127}));
  connect(signal.dr, tested.du) annotation (Line(points = {{-28, -14}, {8, -14}}, color = {0, 0, 127}));
  annotation (experiment(StopTime = 1.4, Interval = 0.001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Duhem operator of degrees 1 and 2. The test compares it with the unit on the signal of <a href=\"modelica://HystFMU.Validation.BaseClasses.TestSignal\">Validation.BaseClasses.TestSignal</a>, at every row of the simulation.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Smooth.Duhem\">Operators.Smooth.Duhem</a>.</p>
</html>"));
end Duhem;
