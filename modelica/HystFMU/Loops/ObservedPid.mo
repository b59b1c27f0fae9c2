within HystFMU.Loops;
block ObservedPid "PID controller and disturbance observer"
  extends Observed(redeclare Control.Pid controller(Ts = Ts));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> equations of Control.Pid and Control.DisturbanceObserver.</p>
<p><b>Source:</b> the scenario pid_observer.</p>
<p><b>Limitations:</b> as for the two blocks.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.PidObserver\">Examples.PidObserver</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.Pid\">Control.Pid</a>, <a href=\"modelica://HystFMU.Loops.Observed\">Loops.Observed</a>.</p>
</html>"));
end ObservedPid;
