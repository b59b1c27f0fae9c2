within HystFMU.Examples;
model ChargeDrive "Stack with a voltage drive and with a charge drive, which causes little hysteresis"
  extends Icons.Example;
  Sources.DecayingSine command(amplitude = 0.8, frequency = 20, decay = 0) annotation (Placement(transformation(extent = {{-100, -10}, {-80, 10}})));
  Actuators.VoltageDrive voltage(v_min = -130) annotation (Placement(transformation(extent = {{-60, 30}, {-40, 50}})));
  Actuators.ChargeDrive charge annotation (Placement(transformation(extent = {{-60, -50}, {-40, -30}})));
  Actuators.Stack underVoltage annotation (Placement(transformation(extent = {{20, 30}, {40, 50}})));
  Actuators.Stack underCharge annotation (Placement(transformation(extent = {{20, -50}, {40, -30}})));
  Plants.Ground ground annotation (Placement(transformation(extent = {{-30, -100}, {-10, -80}})));
  Plants.Fixed fixed annotation (Placement(transformation(extent = {{40, -90}, {60, -70}})));
equation
  connect(command.r, voltage.u) annotation (Line(points = {{-79, 0}, {-70, 0}, {-70, 40}, {-61, 40}}, color = {0, 0, 127}));
  connect(command.r, charge.u) annotation (Line(points = {{-79, 0}, {-70, 0}, {-70, -40}, {-61, -40}}, color = {0, 0, 127}));
  connect(voltage.pin_p, underVoltage.pin_p) annotation (Line(points = {{-39, 45}, {19, 45}}, color = {0, 0, 255}));
  connect(voltage.pin_n, underVoltage.pin_n) annotation (Line(points = {{-39, 35}, {19, 35}}, color = {0, 0, 255}));
  connect(charge.pin_p, underCharge.pin_p) annotation (Line(points = {{-39, -35}, {19, -35}}, color = {0, 0, 255}));
  connect(charge.pin_n, underCharge.pin_n) annotation (Line(points = {{-39, -45}, {19, -45}}, color = {0, 0, 255}));
  connect(voltage.pin_n, ground.pin) annotation (Line(points = {{-39, 35}, {-20, 35}, {-20, -79}}, color = {0, 0, 255}));
  connect(charge.pin_n, ground.pin) annotation (Line(points = {{-39, -45}, {-20, -45}, {-20, -79}}, color = {0, 0, 255}));
  connect(fixed.flange, underVoltage.flange_a) annotation (Line(points = {{61, -80}, {70, -80}, {70, 20}, {30, 20}, {30, 29}}, color = {0, 127, 0}));
  connect(fixed.flange, underCharge.flange_a) annotation (Line(points = {{61, -80}, {70, -80}, {70, -60}, {30, -60}, {30, -51}}, color = {0, 127, 0}));
  annotation (experiment(StopTime = 0.1, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Position over command shows a wide loop with the voltage drive and a narrow loop with the charge drive, because the stroke is proportional to the charge of the polarisation, which is 0.9 of the total charge.</p>
<p><b>Source:</b> structure of the classes below.</p>
<p><b>Limitations:</b> a real charge drive drifts faster because of leakage.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.ChargeDrive\">Actuators.ChargeDrive</a>, <a href=\"modelica://HystFMU.Actuators.VoltageDrive\">Actuators.VoltageDrive</a>, <a href=\"modelica://HystFMU.Actuators.Stack\">Actuators.Stack</a>.</p>
</html>"));
end ChargeDrive;
