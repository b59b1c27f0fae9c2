within HystFMU.Functions;
function firstBranch "First branch of the Preisach operator"
  extends Icons.Function;
  input Real u "Input within [lo, hi]";
  input Real lo "Lower end of the grid";
  input Real hi "Upper end of the grid";
  input Real virgin[:] "First branch at half steps of the grid";
  output Real y "Output";
protected
  Integer k = min(integer(floor((u - lo)/(hi - lo)*(size(virgin, 1) - 1))), size(virgin, 1) - 2) "Index of the half step";
  Real rest = (u - lo)/(hi - lo)*(size(virgin, 1) - 1) - k;
algorithm
  y := virgin[k + 1] + rest*(virgin[k + 2] - virgin[k + 1]);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> linear between the half steps of the grid.</p>
<p><b>Source:</b> Mayergoyz 1991, chapter 1.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>firstBranch(origin, lo, hi, virgin)</code> in <a href=\"modelica://HystFMU.Operators.Events.Preisach\">Operators.Events.Preisach</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Events.Preisach\">Operators.Events.Preisach</a>, <a href=\"modelica://HystFMU.Operators.Sampled.Preisach\">Operators.Sampled.Preisach</a>, <a href=\"modelica://HystFMU.Functions.preisach\">Functions.preisach</a>, which use it.</p>
</html>"));
end firstBranch;
