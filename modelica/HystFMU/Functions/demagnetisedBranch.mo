within HystFMU.Functions;
function demagnetisedBranch "First branch of the demagnetised Preisach operator, at half steps of the grid"
  extends Icons.Function;
  input Integer n "Number of grid steps";
  input Real E[:] "Everett function below the diagonal, row by row";
  input Real offset "Mean of the saturated outputs";
  output Real virgin[2*n + 1] "Outputs";
protected
  Integer i "Row of the square";
  Integer j "Column of the square";
  Real rest "Shift with which the branch ends at saturation";
algorithm
  virgin[n + 1] := 0;
  // 2 dE/dalpha upwards on the line alpha + beta = lo + hi, which changes triangle in the middle of every square
  for k in n:2*n - 1 loop
    i := div(k, 2);
    j := n - 1 - i;
    virgin[k + 2] := virgin[k + 1] + (if mod(k, 2) == 1 then everettNode(E, i + 1, j) - everettNode(E, i, j) else everettNode(E, i + 1, j + 1) - everettNode(E, i, j + 1));
  end for;
  // -2 dE/dbeta downwards
  for s in 0:n - 1 loop
    j := div(n - s - 1, 2);
    i := n - 1 - j;
    virgin[n - s] := virgin[n - s + 1] + (if mod(n - s - 1, 2) == 1 then everettNode(E, i, j + 1) - everettNode(E, i, j) else everettNode(E, i + 1, j + 1) - everettNode(E, i + 1, j));
  end for;
  rest := offset + everettNode(E, n, 0) - virgin[2*n + 1];
  for k in 1:2*n + 1 loop
    virgin[k] := virgin[k] + rest;
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> integral of 2 dE/dalpha (upwards) and -2 dE/dbeta (downwards) on alpha + beta = lo + hi; the branch ends at saturation.</p>
<p><b>Source:</b> Mayergoyz 1991, chapter 1.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>demagnetisedBranch(n, E, offset)</code> in <a href=\"modelica://HystFMU.Functions.virginBranch\">Functions.virginBranch</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.virginBranch\">Functions.virginBranch</a>, which uses it.</p>
</html>"));
end demagnetisedBranch;
