within HystFMU.Functions;
function preisachOrigin "Input at which the first branch of the Preisach operator starts"
  extends Icons.Function;
  input Real lo "Lower end of the grid";
  input Real hi "Upper end of the grid";
  input Types.Magnetisation start "State before the first input";
  output Real origin "Input";
algorithm
  origin := if start == Types.Magnetisation.low then lo elseif start == Types.Magnetisation.high then hi else 0.5*lo + 0.5*hi;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> lo, hi or (lo + hi)/2.</p>
<p><b>Source:</b> Mayergoyz 1991, chapter 1.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>preisachOrigin(lo, hi, start)</code> in <a href=\"modelica://HystFMU.Operators.Sampled.Preisach\">Operators.Sampled.Preisach</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.Preisach\">Operators.Sampled.Preisach</a>, which uses it.</p>
</html>"));
end preisachOrigin;
