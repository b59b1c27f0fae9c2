within HystFMU.Functions;
function saturatedBranch "First branch of the Preisach operator from saturation, at half steps of the grid"
  extends Icons.Function;
  input Integer n "Number of grid steps";
  input Real E[:] "Everett function below the diagonal, row by row";
  input Real offset "Mean of the saturated outputs";
  input Types.Magnetisation start "Initial saturation: low or high";
  output Real virgin[2*n + 1] "Outputs";
algorithm
  for k in 0:2*n loop
    virgin[k + 1] := if start == Types.Magnetisation.low then offset - everettNode(E, n, 0) + everettNode(E, div(k, 2), 0) + everettNode(E, div(k + 1, 2), 0) else offset + everettNode(E, n, 0) - everettNode(E, n, div(k, 2)) - everettNode(E, n, div(k + 1, 2));
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> low: -E_n0 + 2 E(u, lo); high: E_n0 - 2 E(hi, u); both plus offset.</p>
<p><b>Source:</b> Mayergoyz 1991, chapter 1.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>saturatedBranch(n, E, offset, start)</code> in <a href=\"modelica://HystFMU.Functions.virginBranch\">Functions.virginBranch</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.virginBranch\">Functions.virginBranch</a>, which uses it.</p>
</html>"));
end saturatedBranch;
