within HystFMU.Functions;
function virginBranch "First branch of the Preisach operator, at half steps of its grid"
  extends Icons.Function;
  input Integer n "Number of grid steps";
  input Real E[:] "Everett function below the diagonal, row by row";
  input Real offset "Mean of the saturated outputs";
  input Types.Magnetisation start "State before the first input";
  output Real virgin[2*n + 1] "Outputs";
algorithm
  virgin := if start == Types.Magnetisation.demagnetised then demagnetisedBranch(n, E, offset) else saturatedBranch(n, E, offset, start);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> demagnetised: from the middle of the range; low, high: from saturation.</p>
<p><b>Source:</b> Mayergoyz 1991, chapter 1.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>virginBranch(n, E, offset, start)</code> in <a href=\"modelica://HystFMU.Operators.Sampled.Preisach\">Operators.Sampled.Preisach</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.Preisach\">Operators.Sampled.Preisach</a>, which uses it.</p>
</html>"));
end virginBranch;
