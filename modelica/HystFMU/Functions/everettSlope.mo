within HystFMU.Functions;
function everettSlope "Slope of the Everett function, linear between its grid values"
  extends Icons.Function;
  input Real alpha "Upper input";
  input Real beta "Lower input";
  input Real lo "Lower end of the grid";
  input Real hi "Upper end of the grid";
  input Integer n "Number of grid steps";
  input Real E[:] "Values below the diagonal, row by row";
  input Boolean upper "True: derivative by the upper input; false: by the lower input";
  output Real slope "Derivative by the input";
protected
  Integer i = min(integer(floor((alpha - lo)/(hi - lo)*n)), n - 1) "Row of the cell";
  Integer j = min(integer(floor((beta - lo)/(hi - lo)*n)), n - 1) "Column of the cell";
  Real a = (alpha - lo)/(hi - lo)*n - i "Position in the cell";
  Real b = (beta - lo)/(hi - lo)*n - j;
algorithm
  if a >= b then
    slope := if upper then everettNode(E, i + 1, j) - everettNode(E, i, j) else everettNode(E, i + 1, j + 1) - everettNode(E, i + 1, j);
  else
    slope := if upper then everettNode(E, i + 1, j + 1) - everettNode(E, i, j + 1) else everettNode(E, i, j + 1) - everettNode(E, i, j);
  end if;
  slope := slope*n/(hi - lo);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> derivative of Functions.everett on its triangles.</p>
<p><b>Source:</b> Mayergoyz 1991, chapter 1.</p>
<p><b>Limitations:</b> lo &le; beta &le; alpha &le; hi.</p>
<p><b>Example:</b> <code>everettSlope(u, origin[1], lo, hi, n, E, true)</code> in <a href=\"modelica://HystFMU.Functions.preisachSlope\">Functions.preisachSlope</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.preisachSlope\">Functions.preisachSlope</a>, which uses it.</p>
</html>"));
end everettSlope;
