within HystFMU.Examples;
model Pid "PID control of a hysteretic actuator with inverse feed-forward"
  extends Loops.Tracking(redeclare Control.Pid controller(Kp = 0.4761, Ki = 4446, Kd = 0.0003252, tau = 7.305e-06, Ts = Ts));
  annotation (experiment(StopTime = 0.2, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>At every sample the controller reads the displacement and adds its correction to the inverse feed-forward.</p>
<p><b>Source:</b> the scenario pid.</p>
<p><b>Limitations:</b> the case of the scenario with a sine of 10 Hz without disturbance and noise.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Loops.Tracking\">Loops.Tracking</a>, <a href=\"modelica://HystFMU.Examples.SlidingMode\">Examples.SlidingMode</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.PrandtlIshlinskiiInverse\">Inverse.Sampled.PrandtlIshlinskiiInverse</a>.</p>
</html>"));
end Pid;
