within HystFMU.Examples;
model Duhem "PID control of a Duhem actuator without inverse of the hysteresis"
  extends Loops.Tracking(
    redeclare Control.Pid controller(Kp = 0.4761, Ki = 4446, Kd = 0.0003252, tau = 7.305e-06, Ts = Ts),
    redeclare Loops.LinearInverse inverse(gain = 0.9, Ts = Ts),
    redeclare Loops.DuhemPlant plant(Ts = Ts));
  annotation (experiment(StopTime = 0.2, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>This library has no inverse of a Duhem operator. The inverse assumes that the plant is a gain, and the controller corrects the hysteresis.</p>
<p><b>Source:</b> the controller of the scenario pid; Oh &amp; Bernstein 2005 (operator).</p>
<p><b>Limitations:</b> a sine of 10 Hz without disturbance and noise.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Loops.DuhemPlant\">Loops.DuhemPlant</a>, <a href=\"modelica://HystFMU.Loops.LinearInverse\">Loops.LinearInverse</a>, <a href=\"modelica://HystFMU.Loops.Tracking\">Loops.Tracking</a>.</p>
</html>"));
end Duhem;
