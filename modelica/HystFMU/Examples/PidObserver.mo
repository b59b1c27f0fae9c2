within HystFMU.Examples;
model PidObserver "PID and disturbance observer before the inverse on a hysteretic actuator"
  extends Icons.Example;
  parameter Types.Time Ts = 1e-4 "Sample period of the loop";
  parameter Data.BacklashIdentified identified "The plant as identified; its inverse is what the observer looks through" annotation (Placement(transformation(extent = {{-40, 40}, {-20, 60}})));
  Sources.Sine reference(frequency = 10, lead = 1.5*Ts) "Preview of the delay and of half a sample for the hold" annotation (Placement(transformation(extent = {{-100, 0}, {-80, 20}})));
  Control.Feedforward feedforward(f_n = 500, zeta = 0.7) annotation (Placement(transformation(extent = {{-70, -30}, {-50, -10}})));
  Control.Pid controller(Kp = 0.01045, Ki = 1798, Kd = 9.867e-05, Ts = Ts) annotation (Placement(transformation(extent = {{-40, 0}, {-20, 20}})));
  Control.DisturbanceObserver observer(n = 2, f_n = 500, zeta = 0.7, gain = 1, f_o = 1352, Ts = Ts) annotation (Placement(transformation(extent = {{0, 0}, {20, 20}})));
  Inverse.Sampled.PrandtlIshlinskiiInverse inverse(n = identified.hysteresis_n, depth = 16, w0 = identified.hysteresis_w0, r = identified.hysteresis_r, w = identified.hysteresis_w, u0 = identified.hysteresis_u0, Ts = Ts) annotation (Placement(transformation(extent = {{30, 0}, {50, 20}})));
  Dynamics.Delay delay(n = 1, Ts = Ts) "One sample between command and actuator" annotation (Placement(transformation(extent = {{60, -40}, {80, -20}})));
  Plants.BacklashSumDynamics plant(n = 10, w0 = 0.3, r = linspace(0.05, 0.5, 10), w = fill(0.1, 10), f_n = 500, zeta = 0.7, Ts = Ts) annotation (Placement(transformation(extent = {{60, 0}, {80, 20}})));
equation
  connect(reference.r_lead, feedforward.r);
  connect(reference.dr_lead, feedforward.dr);
  connect(reference.ddr_lead, feedforward.ddr);
  connect(feedforward.v, controller.u_ff);
  connect(reference.r, controller.y_d);
  connect(plant.y, controller.y);
  connect(controller.u, observer.u_c);
  connect(plant.y, observer.y);
  inverse.y = (observer.u - identified.readout_offset[1])/identified.readout_gain[1];
  connect(inverse.u, delay.u);
  connect(delay.y, plant.u);
  annotation (experiment(StopTime = 0.2, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Behind the inverse the observer sees a linear plant: what is left of the hysteresis counts as a disturbance and is taken off the command.</p>
<p><b>Source:</b> the scenario pid_observer.</p>
<p><b>Limitations:</b> the case of the scenario with a sine of 10 Hz: no disturbance, no noise.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Examples.Pid\">Examples.Pid</a>, <a href=\"modelica://HystFMU.Control.DisturbanceObserver\">Control.DisturbanceObserver</a>.</p>
</html>"));
end PidObserver;
