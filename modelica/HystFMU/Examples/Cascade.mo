within HystFMU.Examples;
model Cascade "Feed-forward and exact inverse of a hysteretic actuator, no feedback"
  extends Loops.Tracking;
  annotation (experiment(StopTime = 0.2, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>The feed-forward inverts the dynamics, and the exact inverse inverts the hysteresis.</p>
<p><b>Source:</b> the scenario cascade; Zhao &amp; Tan 2008 (cascade inverse).</p>
<p><b>Limitations:</b> the case of the scenario with a sine of 10 Hz without disturbance and noise.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Loops.Tracking\">Loops.Tracking</a>, <a href=\"modelica://HystFMU.Examples.SlidingMode\">Examples.SlidingMode</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.PrandtlIshlinskiiInverse\">Inverse.Sampled.PrandtlIshlinskiiInverse</a>.</p>
</html>"));
end Cascade;
