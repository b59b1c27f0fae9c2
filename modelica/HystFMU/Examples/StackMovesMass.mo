within HystFMU.Examples;
model StackMovesMass "Stack with an identified hysteresis, spring and mass, which starts at half its voltage"
  extends Icons.Example;
  parameter Data.BacklashIdentified identified "Identified hysteresis" annotation (Dialog(group = "Parameters"), Placement(transformation(extent = {{-90, 50}, {-70, 70}})));
  Sources.DecayingSine command(amplitude = 0.45, offset = 0.5, frequency = 50, decay = 20) annotation (Placement(transformation(extent = {{-90, -10}, {-70, 10}})));
  Actuators.VoltageDrive drive(v_start = 50) annotation (Placement(transformation(extent = {{-50, -10}, {-30, 10}})));
  Actuators.Stack stack(withMass = false, v_start = 50, redeclare Actuators.Hysteresis.PrandtlIshlinskii hysteresis(n = identified.hysteresis_n, w0 = identified.hysteresis_w0, r = identified.hysteresis_r, w = identified.hysteresis_w, u_start = 50)) annotation (Placement(transformation(extent = {{10, -10}, {30, 10}})));
  Plants.Ground ground annotation (Placement(transformation(extent = {{-20, -70}, {0, -50}})));
  Plants.Fixed fixed annotation (Placement(transformation(extent = {{-60, -90}, {-40, -70}})));
  Plants.SpringMassLoad load(m = 0.2, c = 300, k = 2e6, fixedStart = true) annotation (Placement(transformation(extent = {{60, -10}, {80, 10}})));
equation
  connect(command.r, drive.u) annotation (Line(points = {{-69, 0}, {-51, 0}}, color = {0, 0, 127}));
  connect(drive.pin_p, stack.pin_p) annotation (Line(points = {{-29, 5}, {9, 5}}, color = {0, 0, 255}));
  connect(drive.pin_n, stack.pin_n) annotation (Line(points = {{-29, -5}, {9, -5}}, color = {0, 0, 255}));
  connect(drive.pin_n, ground.pin) annotation (Line(points = {{-29, -5}, {-10, -5}, {-10, -49}}, color = {0, 0, 255}));
  connect(fixed.flange, stack.flange_a) annotation (Line(points = {{-39, -80}, {20, -80}, {20, -11}}, color = {0, 127, 0}));
  connect(stack.flange_b, load.flange) annotation (Line(points = {{31, 0}, {59, 0}}, color = {0, 127, 0}));
  annotation (experiment(StopTime = 0.1, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Stack and drive start at 50 V. The load is rigidly connected and contains the mass of the stack, so <code>withMass = false</code>. The load starts at 0, not in equilibrium, and oscillates.</p>
<p><b>Source:</b> structure of the classes below.</p>
<p><b>Limitations:</b> the identified model has no unit of measure; its output 1 corresponds to the stroke.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.Stack\">Actuators.Stack</a>, <a href=\"modelica://HystFMU.Actuators.VoltageDrive\">Actuators.VoltageDrive</a>, <a href=\"modelica://HystFMU.Plants.SpringMassLoad\">Plants.SpringMassLoad</a>.</p>
</html>"));
end StackMovesMass;
