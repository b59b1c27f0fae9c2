within HystFMU.Loops;
partial model Tracking "A plant with hysteresis follows a sine: feed-forward, controller, inverse, delay"
  extends Icons.Example;
  parameter Types.Time Ts = 1e-4 "Sample period of the loop" annotation (Dialog(group = "Sampling"));
  Sources.Sine reference(frequency = 10, lead = 1.5*Ts) "Preview time: the delay, and half a sample for the hold" annotation (Placement(transformation(extent = {{-110, 0}, {-90, 20}})));
  Control.Feedforward feedforward(f_n = 500, zeta = 0.7) "Inverts the dynamics" annotation (Placement(transformation(extent = {{-80, -30}, {-60, -10}})));
  replaceable OpenLoop controller constrainedby Interfaces.Controller "Adds a correction to the feed-forward" annotation (choicesAllMatching = true, Placement(transformation(extent = {{-40, -10}, {-20, 10}})));
  replaceable IdentifiedInverse inverse(Ts = Ts) constrainedby Interfaces.Inverse "Inverts the hysteresis" annotation (choicesAllMatching = true, Placement(transformation(extent = {{0, -10}, {20, 10}})));
  Dynamics.Delay delay(n = 1, Ts = Ts) "One sample between command and actuator" annotation (Placement(transformation(extent = {{40, -10}, {60, 10}})));
  replaceable Plants.BacklashSumDynamics plant(Ts = Ts) constrainedby Interfaces.Plant "Controlled plant" annotation (choicesAllMatching = true, Placement(transformation(extent = {{80, -10}, {100, 10}})));
equation
  connect(reference.r_lead, feedforward.r) annotation (Line(points = {{-89, 12}, {-85, 12}, {-85, -14.7}, {-81, -14.7}}, color = {0, 0, 127}));
  connect(reference.dr_lead, feedforward.dr) annotation (Line(points = {{-89, 8}, {-85, 8}, {-85, -20}, {-81, -20}}, color = {0, 0, 127}));
  connect(reference.ddr_lead, feedforward.ddr) annotation (Line(points = {{-89, 4}, {-85, 4}, {-85, -25.4}, {-81, -25.4}}, color = {0, 0, 127}));
  connect(reference.r, controller.y_d) annotation (Line(points = {{-89, 16}, {-65, 16}, {-65, 5.3}, {-41, 5.3}}, color = {0, 0, 127}));
  connect(feedforward.v, controller.u_ff) annotation (Line(points = {{-59, -20}, {-50, -20}, {-50, -5.4}, {-41, -5.4}}, color = {0, 0, 127}));
  connect(plant.y, controller.y) annotation (Line(points = {{101, 0}, {107, 0}, {107, -20}, {-47, -20}, {-47, 0}, {-41, 0}}, color = {0, 0, 127}));
  connect(controller.u, inverse.y) annotation (Line(points = {{-19, 0}, {-1, 0}}, color = {0, 0, 127}));
  connect(inverse.u, delay.u) annotation (Line(points = {{21, 0}, {39, 0}}, color = {0, 0, 127}));
  connect(delay.y, plant.u) annotation (Line(points = {{61, 0}, {79, 0}}, color = {0, 0, 127}));
  annotation (Documentation(info = "<html>
<p>At every sample, the controller reads the displacement and adds its correction to the feed-forward. The inverse
computes the command, which reaches the plant one sample later.</p>
<p><code>model Mine = HystFMU.Loops.Tracking(redeclare HystFMU.Control.Pid controller(Kp = 0.5, Ki = 4000, Ts =
1e-4));</code> is a loop with a controller; by default, there is only a feed-forward. Replacements extend
<a href=\"modelica://HystFMU.Interfaces.Controller\">Interfaces.Controller</a>,
<a href=\"modelica://HystFMU.Interfaces.Inverse\">Interfaces.Inverse</a> or
<a href=\"modelica://HystFMU.Interfaces.Plant\">Interfaces.Plant</a>.</p>
<p><b>Source:</b> scenarios/loops/compensated.toml; plant: Zhao &amp; Tan 2008 (ten plays) and Yu &amp; Alici 2005 (dynamics).</p>
<p><b>Limitations:</b> the reference is a sine; there is no disturbance and no noise. Redeclare each component only
once, because rumoca 0.10.2 ignores a second redeclaration without a message. It also passes Ts to every inverse and
plant.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Examples.Pid\">Examples.Pid</a>, <a href=\"modelica://HystFMU.Examples.Cascade\">Examples.Cascade</a>.</p>
</html>"));
end Tracking;
