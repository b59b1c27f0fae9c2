within HystFMU.Functions;
function everett "Everett function, linear between its grid values"
  extends Icons.Function;
  input Real alpha "Upper input";
  input Real beta "Lower input";
  input Real lo "Lower end of the grid";
  input Real hi "Upper end of the grid";
  input Integer n "Number of grid steps";
  input Real E[:] "Values below the diagonal, row by row";
  output Real e "Half the height of the loop between beta and alpha";
protected
  Integer i = min(integer(floor((alpha - lo)/(hi - lo)*n)), n - 1) "Row of the cell";
  Integer j = min(integer(floor((beta - lo)/(hi - lo)*n)), n - 1) "Column of the cell";
  Real a = (alpha - lo)/(hi - lo)*n - i "Position in the cell";
  Real b = (beta - lo)/(hi - lo)*n - j;
algorithm
  // each square is cut parallel to the diagonal
  if a >= b then
    e := everettNode(E, i, j) + a*(everettNode(E, i + 1, j) - everettNode(E, i, j)) + b*(everettNode(E, i + 1, j + 1) - everettNode(E, i + 1, j));
  else
    e := everettNode(E, i, j) + b*(everettNode(E, i, j + 1) - everettNode(E, i, j)) + a*(everettNode(E, i + 1, j + 1) - everettNode(E, i, j + 1));
  end if;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> linear on triangles whose corners are the nodes of an equidistant grid.</p>
<p><b>Source:</b> Mayergoyz 1991, chapter 1.</p>
<p><b>Limitations:</b> lo &le; beta &le; alpha &le; hi.</p>
<p><b>Example:</b> <code>everett(u, origin[1], lo, hi, n, E)</code> in <a href=\"modelica://HystFMU.Functions.preisach\">Functions.preisach</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.preisach\">Functions.preisach</a>, which uses it.</p>
</html>"));
end everett;
