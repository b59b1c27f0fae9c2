within HystFMU.Examples;
model AmplifiedStack "Stack from a data sheet in a flexure amplifier"
  extends Icons.Example;
  Sources.DecayingSine command(amplitude = 0.5, offset = 0.5, phase = -1.5707963267948966, frequency = 20, decay = 0) annotation (Placement(transformation(extent = {{-90, -10}, {-70, 10}})));
  Actuators.VoltageDrive drive annotation (Placement(transformation(extent = {{-50, -10}, {-30, 10}})));
  Actuators.DataSheetStack stack annotation (Placement(transformation(extent = {{0, -10}, {20, 10}})));
  Actuators.FlexureAmplifier amplifier annotation (Placement(transformation(extent = {{40, -10}, {60, 10}})));
  Plants.Ground ground annotation (Placement(transformation(extent = {{-25, -70}, {-5, -50}})));
  Plants.Fixed fixed annotation (Placement(transformation(extent = {{-60, -90}, {-40, -70}})));
  Plants.SpringMassLoad load(m = 0.05, c = 20, k = 1e4, fixedStart = true) annotation (Placement(transformation(extent = {{80, -10}, {100, 10}})));
equation
  connect(command.r, drive.u) annotation (Line(points = {{-69, 0}, {-51, 0}}, color = {0, 0, 127}));
  connect(drive.pin_p, stack.pin_p) annotation (Line(points = {{-29, 5}, {-1, 5}}, color = {0, 0, 255}));
  connect(drive.pin_n, stack.pin_n) annotation (Line(points = {{-29, -5}, {-1, -5}}, color = {0, 0, 255}));
  connect(drive.pin_n, ground.pin) annotation (Line(points = {{-29, -5}, {-15, -5}, {-15, -49}}, color = {0, 0, 255}));
  connect(fixed.flange, stack.flange_a) annotation (Line(points = {{-39, -80}, {10, -80}, {10, -11}}, color = {0, 127, 0}));
  connect(stack.flange_b, amplifier.flange_a) annotation (Line(points = {{21, 0}, {39, 0}}, color = {0, 127, 0}));
  connect(amplifier.support, fixed.flange) annotation (Line(points = {{50, -11}, {50, -80}, {-39, -80}}, color = {0, 127, 0}));
  connect(amplifier.flange_b, load.flange) annotation (Line(points = {{61, 0}, {79, 0}}, color = {0, 127, 0}));
  annotation (experiment(StopTime = 0.1, Interval = 1e-4, Tolerance = 1e-9),
    Documentation(info = "<html>
<p>The voltage has its full range at 20 Hz. The flexures reduce the stroke; the lever amplifies the rest by five.</p>
<p><b>Source:</b> structure of the classes below.</p>
<p><b>Limitations:</b> the hysteresis has default parameters, scaled to the stroke of the data sheet.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.DataSheetStack\">Actuators.DataSheetStack</a>, <a href=\"modelica://HystFMU.Actuators.DataSheet\">Actuators.DataSheet</a>, <a href=\"modelica://HystFMU.Actuators.FlexureAmplifier\">Actuators.FlexureAmplifier</a>.</p>
</html>"));
end AmplifiedStack;
