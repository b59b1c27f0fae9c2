within HystFMU.Examples;
model Bender "Bender from rest through its first resonance"
  extends Icons.Example;
  Sources.DecayingSine command(amplitude = 0.3, frequency = 60, decay = 5) annotation (Placement(transformation(extent = {{-90, -10}, {-70, 10}})));
  Actuators.VoltageDrive drive(resistance = 100) annotation (Placement(transformation(extent = {{-50, -10}, {-30, 10}})));
  Actuators.Bender bender annotation (Placement(transformation(extent = {{10, -10}, {30, 10}})));
  Plants.Ground ground annotation (Placement(transformation(extent = {{-20, -70}, {0, -50}})));
  Plants.Fixed fixed annotation (Placement(transformation(extent = {{-60, -90}, {-40, -70}})));
equation
  connect(command.r, drive.u) annotation (Line(points = {{-69, 0}, {-51, 0}}, color = {0, 0, 127}));
  connect(drive.pin_p, bender.pin_p) annotation (Line(points = {{-29, 5}, {9, 5}}, color = {0, 0, 255}));
  connect(drive.pin_n, bender.pin_n) annotation (Line(points = {{-29, -5}, {9, -5}}, color = {0, 0, 255}));
  connect(drive.pin_n, ground.pin) annotation (Line(points = {{-29, -5}, {-10, -5}, {-10, -49}}, color = {0, 0, 255}));
  connect(fixed.flange, bender.flange_a) annotation (Line(points = {{-39, -80}, {20, -80}, {20, -11}}, color = {0, 127, 0}));
  annotation (experiment(StopTime = 0.1, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>A free bender of 40 mm has its first mode near 170 Hz. After a transient, its tip follows the voltage with hysteresis.</p>
<p><b>Source:</b> structure of the classes below.</p>
<p><b>Limitations:</b> first mode only.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.Bender\">Actuators.Bender</a>, <a href=\"modelica://HystFMU.Actuators.VoltageDrive\">Actuators.VoltageDrive</a>.</p>
</html>"));
end Bender;
