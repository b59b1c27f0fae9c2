// generated from the table of fmu_build/core/blocks/controllers/lead_lag.c by `make generate` - do not edit
within HystFMU.Control.BaseClasses;
partial block LeadLag "Lead-lag controller with feed-forward and limits: parameters and ports"
  extends Interfaces.Controller;
  parameter Integer n(min = 1) = 1 "Number of sections" annotation (Dialog(group = "Sizes"));
  parameter Real K = 0 "Static gain" annotation (Dialog(group = "Gains"));
  parameter Types.Time T_z[n](each min = 0) = fill(1.0, n) "Time constants of the zeros; greater than T_p for a lead" annotation (Dialog(group = "Dynamics"));
  parameter Types.Time T_p[n](each min = 0) = fill(0.1, n) "Time constants of the poles; greater than 0" annotation (Dialog(group = "Dynamics"));
  parameter Real u_min = -1e300 "Lower limit of u" annotation (Dialog(group = "Limits"));
  parameter Real u_max = 1e300 "Upper limit of u" annotation (Dialog(group = "Limits"));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> u = u_ff + K prod_i (T_z,i s + 1) / (T_p,i s + 1) e, e = y_d - y, s = 2/h (z - 1)/(z + 1).</p>
<p><b>Source:</b> Franklin, Powell &amp; Workman, Digital Control of Dynamic Systems, 3rd ed., sections 5.3 and 6.1.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.LeadLag\">Examples.LeadLag</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.LeadLag\">Control.LeadLag</a>, <a href=\"modelica://HystFMU.Validation.LeadLag\">Validation.LeadLag</a>.</p>
</html>"));
end LeadLag;
