within HystFMU.Functions;
function playRate "Rate of a play with a rounded corner"
  extends Icons.Function;
  input Real u "Input";
  input Real du "Rate of the input";
  input Real r "Half-width";
  input Real z "Play";
  input Real width "Width of the rounded corner";
  output Real dz "Rate of the play";
algorithm
  dz := max(du, 0)*min(max(1 + (u - z - r)/width, 0), 1) + min(du, 0)*min(max(1 + (z - u - r)/width, 0), 1);
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> z' = max(u', 0) S((u - z - r)/width) + min(u', 0) S((z - u - r)/width), S(x) = min(max(1 + x, 0), 1).</p>
<p><b>Source:</b> play as a differential inclusion (Krejci &amp; Kuhnen 2001, eq. 3), its corner rounded.</p>
<p><b>Limitations:</b> abs(u - z) is at most r, and the distance to the exact play at most width.</p>
<p><b>Example:</b> <code>playRate(u, rate, r[i], z[i], width)</code> in <a href=\"modelica://HystFMU.Operators.Smooth.BacklashSum\">Operators.Smooth.BacklashSum</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Smooth.BacklashSum\">Operators.Smooth.BacklashSum</a>, <a href=\"modelica://HystFMU.Operators.Smooth.ConstraintFactor\">Operators.Smooth.ConstraintFactor</a>, <a href=\"modelica://HystFMU.Operators.Smooth.PlayBank\">Operators.Smooth.PlayBank</a>, <a href=\"modelica://HystFMU.Operators.Smooth.PrandtlIshlinskii\">Operators.Smooth.PrandtlIshlinskii</a>, which use it.</p>
</html>"));
end playRate;
