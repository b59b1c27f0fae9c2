within HystFMU.Functions;
function leadLag "Sections of a lead-lag controller after a new error"
  extends Icons.Function;
  input Real e "Input of the first section";
  input Real sections[:] "Outputs of the lags, then inputs of the sections, at the last step";
  input Real T_z[:] "Time constants of the zeros";
  input Real T_p[:] "Time constants of the poles";
  input Real dt "Step; 0: start in equilibrium with e";
  output Real sections_new[size(sections, 1)] "Outputs of the lags, then inputs of the sections, at this step";
protected
  Integer n = size(T_z, 1);
  Real direct "Direct gain T_z/T_p of a section";
  Real passed "Input of the section";
algorithm
  passed := e;
  for i in 1:n loop
    direct := T_z[i]/T_p[i];
    // the bilinear rule
    sections_new[i] := if dt > 0 then ((2*T_p[i] - dt)*sections[i] + dt*(1 - direct)*(passed + sections[n + i]))/(2*T_p[i] + dt) else (1 - direct)*passed;
    sections_new[n + i] := passed;
    passed := sections_new[i] + direct*passed;
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> (T_z s + 1)/(T_p s + 1) = T_z/T_p + (1 - T_z/T_p)/(T_p s + 1), s = 2/dt (z - 1)/(z + 1).</p>
<p><b>Source:</b> bilinear rule: Franklin, Powell &amp; Workman, Digital Control of Dynamic Systems, 3rd ed., section 6.1.</p>
<p><b>Limitations:</b> T_p &gt; 0.</p>
<p><b>Example:</b> <code>leadLag(y_d - y, pre(sections), T_z, T_p, dt)</code> in <a href=\"modelica://HystFMU.Control.LeadLag\">Control.LeadLag</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.LeadLag\">Control.LeadLag</a>, which uses it.</p>
</html>"));
end leadLag;
