within HystFMU.Examples;
model LeadLag "Lead-lag and disturbance observer before the inverse on a hysteretic actuator"
  extends Loops.Tracking(redeclare Loops.ObservedLeadLag controller(controller(n = 1, K = 3.295, T_z = {2.751e-05}, T_p = {0.002122}), observer(f_o = 1980), Ts = Ts));
  annotation (experiment(StopTime = 0.2, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>The observer is the integral action of the loop: the lead-lag alone would leave a steady error.</p>
<p><b>Source:</b> the scenario lead_lag.</p>
<p><b>Limitations:</b> the case of the scenario with a sine of 10 Hz: no disturbance, no noise.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Loops.Tracking\">Loops.Tracking</a>, <a href=\"modelica://HystFMU.Examples.PidObserver\">Examples.PidObserver</a>, <a href=\"modelica://HystFMU.Control.LeadLag\">Control.LeadLag</a>.</p>
</html>"));
end LeadLag;
