within HystFMU.Functions;
function everettLeastDensity "Least density of an Everett function on its grid"
  extends Icons.Function;
  input Integer n "Number of grid steps";
  input Real E[:] "Values below the diagonal, row by row";
  output Real least "Least density, without rounding errors";
protected
  Real mass "Density of a square";
algorithm
  least := everettNode(E, 1, 0);
  for i in 0:n - 1 loop
    for j in 0:i loop
      mass := everettNode(E, i + 1, j) - everettNode(E, i, j) + everettNode(E, i, j + 1) - everettNode(E, i + 1, j + 1);
      least := min(least, mass);
    end for;
  end for;
  least := if least > -1e-12*max(abs(E)) then max(least, 0) else least;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> least of E(i + 1, j) - E(i, j) + E(i, j + 1) - E(i + 1, j + 1), which is half the weight of the relays in a square of the grid.</p>
<p><b>Source:</b> Mayergoyz 1991, chapter 1.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>everettLeastDensity(n, E)</code> in <a href=\"modelica://HystFMU.Actuators.Hysteresis.Preisach\">Actuators.Hysteresis.Preisach</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.Hysteresis.Preisach\">Actuators.Hysteresis.Preisach</a>, which uses it.</p>
</html>"));
end everettLeastDensity;
