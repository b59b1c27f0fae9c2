within HystFMU.Examples;
model PidObserver "PID control of a hysteretic actuator with inverse and disturbance observer"
  extends Loops.Tracking(redeclare Loops.ObservedPid controller(controller(Kp = 0.01045, Ki = 1798, Kd = 9.867e-05), observer(f_o = 1352), Ts = Ts));
  annotation (experiment(StopTime = 0.2, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Inverse and actuator in series are an almost linear plant for the observer. The observer estimates the remaining hysteresis as a disturbance and subtracts it from the command.</p>
<p><b>Source:</b> the scenario pid_observer.</p>
<p><b>Limitations:</b> the case of the scenario with a sine of 10 Hz without disturbance and noise.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Loops.Tracking\">Loops.Tracking</a>, <a href=\"modelica://HystFMU.Examples.Pid\">Examples.Pid</a>, <a href=\"modelica://HystFMU.Control.DisturbanceObserver\">Control.DisturbanceObserver</a>.</p>
</html>"));
end PidObserver;
