within HystFMU.Examples;
model StackInLoop "PID control of a stack with amplifier, load, sensor and inverse"
  extends Icons.Example;
  parameter Types.Time Ts = 1e-4 "Sample period of the loop" annotation (Dialog(group = "Sampling"));
  parameter Data.BacklashIdentified identified "Identified hysteresis" annotation (Dialog(group = "Parameters"), Placement(transformation(extent = {{-100, 60}, {-80, 80}})));
  Sources.Sine reference(frequency = 10, lead = 1.5*Ts) "Relative to the stroke" annotation (Placement(transformation(extent = {{-150, -10}, {-130, 10}})));
  Control.Pid controller(Kp = 0.05, Ki = 1500, Ts = Ts) annotation (Placement(transformation(extent = {{-110, -10}, {-90, 10}})));
  Loops.IdentifiedInverse inverse(Ts = Ts) annotation (Placement(transformation(extent = {{-70, -10}, {-50, 10}})));
  Dynamics.Delay delay(n = 1, Ts = Ts) "One sample between command and amplifier" annotation (Placement(transformation(extent = {{-40, -10}, {-20, 10}})));
  Actuators.VoltageDrive drive(gain = 100, v_min = -130) annotation (Placement(transformation(extent = {{-10, -10}, {10, 10}})));
  Actuators.Stack stack(withMass = false, redeclare Actuators.Hysteresis.PrandtlIshlinskii hysteresis(n = identified.hysteresis_n, w0 = identified.hysteresis_w0, r = identified.hysteresis_r, w = identified.hysteresis_w)) annotation (Placement(transformation(extent = {{40, -10}, {60, 10}})));
  Plants.Ground ground annotation (Placement(transformation(extent = {{10, -60}, {30, -40}})));
  Plants.Fixed fixed annotation (Placement(transformation(extent = {{0, -100}, {20, -80}})));
  Plants.SpringMassLoad load(m = 0.2, c = 3000, k = 2e6) annotation (Placement(transformation(extent = {{80, -10}, {100, 10}})));
  Plants.PositionSensor sensor annotation (Placement(transformation(extent = {{80, -60}, {100, -40}})));
  Loops.Affine reading(gain = 1.025/26e-6) "Conversion from metres to the stroke" annotation (Placement(transformation(extent = {{110, -60}, {130, -40}})));
equation
  connect(reference.r, controller.y_d) annotation (Line(points = {{-129, 6}, {-120, 6}, {-120, 5.3}, {-111, 5.3}}, color = {0, 0, 127}));
  connect(reference.r_lead, controller.u_ff) annotation (Line(points = {{-129, 2}, {-120, 2}, {-120, -5.4}, {-111, -5.4}}, color = {0, 0, 127}));
  connect(reading.y, controller.y) annotation (Line(points = {{131, -50}, {137, -50}, {137, -70}, {-117, -70}, {-117, 0}, {-111, 0}}, color = {0, 0, 127}));
  connect(controller.u, inverse.y) annotation (Line(points = {{-89, 0}, {-71, 0}}, color = {0, 0, 127}));
  connect(inverse.u, delay.u) annotation (Line(points = {{-49, 0}, {-41, 0}}, color = {0, 0, 127}));
  connect(delay.y, drive.u) annotation (Line(points = {{-19, 0}, {-11, 0}}, color = {0, 0, 127}));
  connect(drive.pin_p, stack.pin_p) annotation (Line(points = {{11, 5}, {39, 5}}, color = {0, 0, 255}));
  connect(drive.pin_n, stack.pin_n) annotation (Line(points = {{11, -5}, {39, -5}}, color = {0, 0, 255}));
  connect(drive.pin_n, ground.pin) annotation (Line(points = {{11, -5}, {15.5, -5}, {15.5, -39}, {20, -39}}, color = {0, 0, 255}));
  connect(fixed.flange, stack.flange_a) annotation (Line(points = {{21, -90}, {35.5, -90}, {35.5, -11}, {50, -11}}, color = {0, 127, 0}));
  connect(stack.flange_b, load.flange) annotation (Line(points = {{61, 0}, {79, 0}}, color = {0, 127, 0}));
  connect(stack.flange_b, sensor.flange) annotation (Line(points = {{61, 0}, {70, 0}, {70, -50}, {79, -50}}, color = {0, 127, 0}));
  connect(sensor.s, reading.u) annotation (Line(points = {{101, -50}, {109, -50}}, color = {0, 0, 127}));
  annotation (experiment(StopTime = 0.2, Interval = 1e-4, Tolerance = 1e-9),
    Documentation(info = "<html>
<p>Plot reading.y over reference.r: the inverse compensates for the hysteresis. The controller corrects the effects of the spring of the load and of the amplifier. With Ki = 0, the stroke is a twentieth too small.</p>
<p>An exported actuator can replace the stack: <code>MyPackage.Actuator stack(withMass = false)</code>.</p>
<p><b>Source:</b> structure of the classes below.</p>
<p><b>Limitations:</b> the identified model has no unit of measure; its output 1 corresponds to the stroke.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.Stack\">Actuators.Stack</a>, <a href=\"modelica://HystFMU.Plants.PositionSensor\">Plants.PositionSensor</a>, <a href=\"modelica://HystFMU.Control.Pid\">Control.Pid</a>, <a href=\"modelica://HystFMU.Loops.Tracking\">Loops.Tracking</a>.</p>
</html>"));
end StackInLoop;
