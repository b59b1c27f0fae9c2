within HystFMU.Examples;
model Duhem "PID around a Duhem actuator, no inverse of its hysteresis"
  extends Loops.Tracking(
    redeclare Control.Pid controller(Kp = 0.4761, Ki = 4446, Kd = 0.0003252, tau = 7.305e-06, Ts = Ts),
    redeclare Loops.LinearInverse inverse(gain = 0.9, Ts = Ts),
    redeclare Loops.DuhemPlant plant(Ts = Ts));
  annotation (experiment(StopTime = 0.2, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>A Duhem operator has no inverse in this library: the plant is taken as a gain, and the controller takes off the hysteresis.</p>
<p><b>Source:</b> the controller of the scenario pid; Oh &amp; Bernstein 2005 (operator).</p>
<p><b>Limitations:</b> a sine of 10 Hz: no disturbance, no noise.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Loops.DuhemPlant\">Loops.DuhemPlant</a>, <a href=\"modelica://HystFMU.Loops.LinearInverse\">Loops.LinearInverse</a>, <a href=\"modelica://HystFMU.Loops.Tracking\">Loops.Tracking</a>.</p>
</html>"));
end Duhem;
