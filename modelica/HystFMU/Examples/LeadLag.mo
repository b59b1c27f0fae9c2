within HystFMU.Examples;
model LeadLag "Lead-lag control of a hysteretic actuator with inverse and disturbance observer"
  extends Loops.Tracking(redeclare Loops.ObservedLeadLag controller(controller(n = 1, K = 3.295, T_z = {2.751e-05}, T_p = {0.002122}), observer(f_o = 1980), Ts = Ts));
  annotation (experiment(StopTime = 0.2, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>The observer provides the integral action of the loop. With the lead-lag controller alone, a steady error remains.</p>
<p><b>Source:</b> the scenario lead_lag.</p>
<p><b>Limitations:</b> the case of the scenario with a sine of 10 Hz without disturbance and noise.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Loops.Tracking\">Loops.Tracking</a>, <a href=\"modelica://HystFMU.Examples.PidObserver\">Examples.PidObserver</a>, <a href=\"modelica://HystFMU.Control.LeadLag\">Control.LeadLag</a>.</p>
</html>"));
end LeadLag;
