within HystFMU.Functions;
function preisachSlope "Slope of the branch of the Preisach operator"
  extends Icons.Function;
  input Real u "Input within [lo, hi]";
  input Real memory[:] "Memory from the function turn, for the input u";
  input Real lo "Lower end of the grid";
  input Real hi "Upper end of the grid";
  input Integer n "Number of grid steps";
  input Real E[:] "Everett function below the diagonal, row by row";
  input Real virgin[:] "First branch at half steps of the grid";
  output Real slope "Derivative of the output by the input";
protected
  Real origin[3] = branchOrigin(memory, 0, 0) "Input and output at the start of the branch";
  Integer k = min(integer(floor((u - lo)/(hi - lo)*2*n)), 2*n - 1) "Index of the half step of the first branch";
algorithm
  if memory[1] < 0.5 then
    slope := (virgin[k + 2] - virgin[k + 1])*2*n/(hi - lo);
  elseif memory[2] > 0 then
    slope := 2*everettSlope(u, origin[1], lo, hi, n, E, true);
  else
    slope := -2*everettSlope(origin[1], u, lo, hi, n, E, false);
  end if;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> 2 dE/dalpha rising, -2 dE/dbeta falling.</p>
<p><b>Smoothness:</b> the slope jumps at the nodes of the grid and where stored extrema are deleted.</p>
<p><b>Source:</b> derivative of Functions.preisach.</p>
<p><b>Smoothness:</b> the slope jumps at the knots of E.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>preisachSlope(bounded, Functions.turn(bounded, origin, pre(p_turn), pre(memory)), lo, hi, n, E, virgin)</code> in <a href=\"modelica://HystFMU.Actuators.Hysteresis.Preisach\">Actuators.Hysteresis.Preisach</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.Hysteresis.Preisach\">Actuators.Hysteresis.Preisach</a>, which uses it.</p>
</html>"));
end preisachSlope;
