within HystFMU.Functions;
function deadZone "One-sided dead zones"
  extends Icons.Function;
  input Real u "Input";
  input Real r[:] "Thresholds; the sign selects the side";
  output Real s[size(r, 1)] "Outputs";
algorithm
  for i in 1:size(r, 1) loop
    s[i] := if r[i] > 0 then max(u - r[i], 0) elseif r[i] < 0 then min(u - r[i], 0) else u;
  end for;
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> S = max(u - r, 0) for r &gt; 0, min(u - r, 0) for r &lt; 0, u for r = 0.</p>
<p><b>Source:</b> Kuhnen, European Journal of Control 9 (2003) 407-418.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>deadZone(u, r)</code> in <a href=\"modelica://HystFMU.Operators.DeadZones\">Operators.DeadZones</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.DeadZones\">Operators.DeadZones</a>, which uses it.</p>
</html>"));
end deadZone;
