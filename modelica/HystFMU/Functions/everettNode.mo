within HystFMU.Functions;
function everettNode "Everett function at a node of its grid"
  extends Icons.Function;
  input Real E[:] "Values below the diagonal, row by row";
  input Integer i "Row: alpha_i";
  input Integer j "Column: beta_j";
  output Real e "Value; 0 on and above the diagonal";
algorithm
  e := if i > j then E[max(div(i*(i - 1), 2) + j + 1, 1)] else 0;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> E_ij = E[i (i - 1)/2 + j + 1] for i &gt; j.</p>
<p><b>Source:</b> Everett 1955.</p>
<p><b>Limitations:</b> rows and columns count from 0.</p>
<p><b>Example:</b> <code>everettNode(E, i, j)</code> in <a href=\"modelica://HystFMU.Functions.everett\">Functions.everett</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.demagnetisedBranch\">Functions.demagnetisedBranch</a>, <a href=\"modelica://HystFMU.Functions.everett\">Functions.everett</a>, <a href=\"modelica://HystFMU.Functions.saturatedBranch\">Functions.saturatedBranch</a>, which use it.</p>
</html>"));
end everettNode;
