within HystFMU.Examples;
model Cascade "Feed-forward and exact inverse before a hysteretic actuator, no feedback"
  extends Icons.Example;
  parameter Types.Time Ts = 1e-4 "Sample period of the loop";
  Sources.Sine reference(frequency = 10, lead = 0.5*Ts) "Preview of half a sample for the hold" annotation (Placement(transformation(extent = {{-100, 0}, {-80, 20}})));
  Control.Feedforward feedforward(f_n = 500, zeta = 0.7) annotation (Placement(transformation(extent = {{-70, -30}, {-50, -10}})));
  Inverse.Sampled.PrandtlIshlinskiiInverse inverse(n = 10, depth = 16, w0 = 0.3, r = linspace(0.05, 0.5, 10), w = fill(0.1, 10), Ts = Ts) annotation (Placement(transformation(extent = {{-40, -30}, {-20, -10}})));
  Plants.BacklashSumDynamics plant(n = 10, w0 = 0.3, r = linspace(0.05, 0.5, 10), w = fill(0.1, 10), f_n = 500, zeta = 0.7, Ts = Ts) annotation (Placement(transformation(extent = {{40, 0}, {60, 20}})));
equation
  connect(reference.r_lead, feedforward.r);
  connect(reference.dr_lead, feedforward.dr);
  connect(reference.ddr_lead, feedforward.ddr);
  connect(feedforward.v, inverse.y);
  connect(inverse.u, plant.u);
  annotation (experiment(StopTime = 0.3, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Open-loop compensation: the feed-forward inverts the dynamics, the exact inverse the hysteresis.</p>
<p><b>Source:</b> the scenario cascade; Zhao &amp; Tan 2008 (cascade inverse).</p>
<p><b>Limitations:</b> the case of the scenario with a sine of 10 Hz: no disturbance, no noise.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Examples.SlidingMode\">Examples.SlidingMode</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.PrandtlIshlinskiiInverse\">Inverse.Sampled.PrandtlIshlinskiiInverse</a>.</p>
</html>"));
end Cascade;
