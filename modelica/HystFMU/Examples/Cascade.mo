within HystFMU.Examples;
model Cascade "Feed-forward and exact inverse before a hysteretic actuator, no feedback"
  extends Icons.Example;
  parameter Types.Time Ts = 1e-4 "Sample period of the loop" annotation (Dialog(group = "Sampling"));
  parameter Data.BacklashIdentified identified "The plant as identified" annotation (Dialog(group = "Parameters"), Placement(transformation(extent = {{-40, 40}, {-20, 60}})));
  Sources.Sine reference(frequency = 10, lead = 1.5*Ts) "Preview of the delay and of half a sample for the hold" annotation (Placement(transformation(extent = {{-100, 0}, {-80, 20}})));
  Control.Feedforward feedforward(f_n = 500, zeta = 0.7) annotation (Placement(transformation(extent = {{-70, -30}, {-50, -10}})));
  Inverse.Sampled.PrandtlIshlinskiiInverse inverse(n = identified.hysteresis_n, depth = 16, w0 = identified.hysteresis_w0, r = identified.hysteresis_r, w = identified.hysteresis_w, u0 = identified.hysteresis_u0, Ts = Ts) annotation (Placement(transformation(extent = {{-40, -30}, {-20, -10}})));
  Dynamics.Delay delay(n = 1, Ts = Ts) "One sample between command and actuator" annotation (Placement(transformation(extent = {{60, -40}, {80, -20}})));
  Plants.BacklashSumDynamics plant(n = 10, w0 = 0.3, r = linspace(0.05, 0.5, 10), w = fill(0.1, 10), f_n = 500, zeta = 0.7, Ts = Ts) annotation (Placement(transformation(extent = {{40, 0}, {60, 20}})));
equation
  connect(reference.r_lead, feedforward.r) annotation (Line(points = {{-79, 12}, {-75, 12}, {-75, -14.7}, {-71, -14.7}}, color = {0, 0, 127}));
  connect(reference.dr_lead, feedforward.dr) annotation (Line(points = {{-79, 8}, {-75, 8}, {-75, -20}, {-71, -20}}, color = {0, 0, 127}));
  connect(reference.ddr_lead, feedforward.ddr) annotation (Line(points = {{-79, 4}, {-75, 4}, {-75, -25.4}, {-71, -25.4}}, color = {0, 0, 127}));
  inverse.y = (feedforward.v - identified.readout_offset[1])/identified.readout_gain[1];
  connect(inverse.u, delay.u) annotation (Line(points = {{-19, -20}, {20, -20}, {20, -30}, {59, -30}}, color = {0, 0, 127}));
  connect(delay.y, plant.u) annotation (Line(points = {{81, -30}, {87, -30}, {87, -50}, {33, -50}, {33, 10}, {39, 10}}, color = {0, 0, 127}));
  annotation (experiment(StopTime = 0.2, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Open-loop compensation: the feed-forward inverts the dynamics, the exact inverse the hysteresis.</p>
<p><b>Source:</b> the scenario cascade; Zhao &amp; Tan 2008 (cascade inverse).</p>
<p><b>Limitations:</b> the case of the scenario with a sine of 10 Hz: no disturbance, no noise.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Examples.SlidingMode\">Examples.SlidingMode</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.PrandtlIshlinskiiInverse\">Inverse.Sampled.PrandtlIshlinskiiInverse</a>.</p>
</html>"));
end Cascade;
