within HystFMU.Loops;
block ObservedLeadLag "Lead-lag controller and disturbance observer"
  extends Observed(redeclare Control.LeadLag controller(Ts = Ts));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> equations of Control.LeadLag and Control.DisturbanceObserver.</p>
<p><b>Source:</b> the scenario lead_lag.</p>
<p><b>Limitations:</b> as for the two blocks.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.LeadLag\">Examples.LeadLag</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.LeadLag\">Control.LeadLag</a>, <a href=\"modelica://HystFMU.Loops.Observed\">Loops.Observed</a>.</p>
</html>"));
end ObservedLeadLag;
