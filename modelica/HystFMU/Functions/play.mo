within HystFMU.Functions;
function play "Play (backlash) operators after a new input"
  extends Icons.Function;
  input Real u "New input";
  input Real r[:] "Half-widths";
  input Real z[size(r, 1)] "Last play states";
  output Real z_new[size(r, 1)] "New play states";
algorithm
  for i in 1:size(r, 1) loop
    z_new[i] := if z[i] < u - r[i] then u - r[i] elseif z[i] > u + r[i] then u + r[i] else z[i];
  end for;
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> z+ = max(u - r, min(u + r, z)).</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 3.</p>
<p><b>Limitation:</b> r &ge; 0; a deadband width as in Simulink is 2 r.</p>
<p><b>Example:</b> <code>play(u, r, z0)</code> in <a href=\"modelica://HystFMU.Operators.Smooth.BacklashSum\">Operators.Smooth.BacklashSum</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Events.BacklashSum\">Operators.Events.BacklashSum</a>, <a href=\"modelica://HystFMU.Operators.Events.PlayBank\">Operators.Events.PlayBank</a>, <a href=\"modelica://HystFMU.Operators.Events.StopBank\">Operators.Events.StopBank</a>, <a href=\"modelica://HystFMU.Operators.Sampled.BacklashSum\">Operators.Sampled.BacklashSum</a>, <a href=\"modelica://HystFMU.Inverse.AdaptiveInverse\">Inverse.AdaptiveInverse</a>, which use it.</p>
</html>"));
end play;
