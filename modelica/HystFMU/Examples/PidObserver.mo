within HystFMU.Examples;
model PidObserver "PID and disturbance observer before the inverse on a hysteretic actuator"
  extends Loops.Tracking(redeclare Loops.ObservedPid controller(controller(Kp = 0.01045, Ki = 1798, Kd = 9.867e-05), observer(f_o = 1352), Ts = Ts));
  annotation (experiment(StopTime = 0.2, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Behind the inverse the observer sees a linear plant: what is left of the hysteresis counts as a disturbance and is taken off the command.</p>
<p><b>Source:</b> the scenario pid_observer.</p>
<p><b>Limitations:</b> the case of the scenario with a sine of 10 Hz: no disturbance, no noise.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Loops.Tracking\">Loops.Tracking</a>, <a href=\"modelica://HystFMU.Examples.Pid\">Examples.Pid</a>, <a href=\"modelica://HystFMU.Control.DisturbanceObserver\">Control.DisturbanceObserver</a>.</p>
</html>"));
end PidObserver;
