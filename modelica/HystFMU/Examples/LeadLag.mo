within HystFMU.Examples;
model LeadLag "Lead-lag and disturbance observer before the inverse on a hysteretic actuator"
  extends Icons.Example;
  parameter Types.Time Ts = 1e-4 "Sample period of the loop" annotation (Dialog(group = "Sampling"));
  parameter Data.BacklashIdentified identified "The plant as identified; its inverse is what the observer looks through" annotation (Dialog(group = "Parameters"), Placement(transformation(extent = {{-40, 40}, {-20, 60}})));
  Sources.Sine reference(frequency = 10, lead = 1.5*Ts) "Preview of the delay and of half a sample for the hold" annotation (Placement(transformation(extent = {{-100, 0}, {-80, 20}})));
  Control.Feedforward feedforward(f_n = 500, zeta = 0.7) annotation (Placement(transformation(extent = {{-70, -30}, {-50, -10}})));
  Control.LeadLag controller(n = 1, K = 3.295, T_z = {2.751e-05}, T_p = {0.002122}, Ts = Ts) annotation (Placement(transformation(extent = {{-40, 0}, {-20, 20}})));
  Control.DisturbanceObserver observer(n = 2, f_n = 500, zeta = 0.7, gain = 1, f_o = 1980, Ts = Ts) annotation (Placement(transformation(extent = {{0, 0}, {20, 20}})));
  Inverse.Sampled.PrandtlIshlinskiiInverse inverse(n = identified.hysteresis_n, depth = 16, w0 = identified.hysteresis_w0, r = identified.hysteresis_r, w = identified.hysteresis_w, u0 = identified.hysteresis_u0, Ts = Ts) annotation (Placement(transformation(extent = {{30, 0}, {50, 20}})));
  Dynamics.Delay delay(n = 1, Ts = Ts) "One sample between command and actuator" annotation (Placement(transformation(extent = {{60, -40}, {80, -20}})));
  Plants.BacklashSumDynamics plant(n = 10, w0 = 0.3, r = linspace(0.05, 0.5, 10), w = fill(0.1, 10), f_n = 500, zeta = 0.7, Ts = Ts) annotation (Placement(transformation(extent = {{60, 0}, {80, 20}})));
equation
  connect(reference.r_lead, feedforward.r) annotation (Line(points = {{-79, 12}, {-75, 12}, {-75, -14.7}, {-71, -14.7}}, color = {0, 0, 127}));
  connect(reference.dr_lead, feedforward.dr) annotation (Line(points = {{-79, 8}, {-75, 8}, {-75, -20}, {-71, -20}}, color = {0, 0, 127}));
  connect(reference.ddr_lead, feedforward.ddr) annotation (Line(points = {{-79, 4}, {-75, 4}, {-75, -25.4}, {-71, -25.4}}, color = {0, 0, 127}));
  connect(feedforward.v, controller.u_ff) annotation (Line(points = {{-49, -20}, {-45, -20}, {-45, 4.6}, {-41, 4.6}}, color = {0, 0, 127}));
  connect(reference.r, controller.y_d) annotation (Line(points = {{-79, 16}, {-60, 16}, {-60, 15.3}, {-41, 15.3}}, color = {0, 0, 127}));
  connect(plant.y, controller.y) annotation (Line(points = {{81, 10}, {87, 10}, {87, -10}, {-47, -10}, {-47, 10}, {-41, 10}}, color = {0, 0, 127}));
  connect(controller.u, observer.u_c) annotation (Line(points = {{-19, 10}, {-10, 10}, {-10, 14}, {-1, 14}}, color = {0, 0, 127}));
  connect(plant.y, observer.y) annotation (Line(points = {{81, 10}, {87, 10}, {87, -14}, {-7, -14}, {-7, 6}, {-1, 6}}, color = {0, 0, 127}));
  inverse.y = (observer.u - identified.readout_offset[1])/identified.readout_gain[1];
  connect(inverse.u, delay.u) annotation (Line(points = {{51, 10}, {55, 10}, {55, -30}, {59, -30}}, color = {0, 0, 127}));
  connect(delay.y, plant.u) annotation (Line(points = {{81, -30}, {87, -30}, {87, -50}, {53, -50}, {53, 10}, {59, 10}}, color = {0, 0, 127}));
  annotation (experiment(StopTime = 0.2, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>The observer is the integral action of the loop: the lead-lag alone would leave a steady error.</p>
<p><b>Source:</b> the scenario lead_lag.</p>
<p><b>Limitations:</b> the case of the scenario with a sine of 10 Hz: no disturbance, no noise.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Examples.PidObserver\">Examples.PidObserver</a>, <a href=\"modelica://HystFMU.Control.LeadLag\">Control.LeadLag</a>.</p>
</html>"));
end LeadLag;
