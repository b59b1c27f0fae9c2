within HystFMU.Functions;
function preisach "Branch of the Preisach operator"
  extends Icons.Function;
  input Real u "Input within [lo, hi]";
  input Real memory[:] "Memory from the function turn, for the input u";
  input Real lo "Lower end of the grid";
  input Real hi "Upper end of the grid";
  input Integer n "Number of grid steps";
  input Real E[:] "Everett function below the diagonal, row by row";
  input Real virgin[:] "First branch at half steps of the grid";
  output Real y "Output";
protected
  Real origin[3] = branchOrigin(memory, 0, 0) "Input and output at the start of the branch";
algorithm
  if memory[1] < 0.5 then
    y := firstBranch(u, lo, hi, virgin);
  elseif memory[2] > 0 then
    y := origin[2] + 2*everett(u, origin[1], lo, hi, n, E);
  else
    y := origin[2] - 2*everett(origin[1], u, lo, hi, n, E);
  end if;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = y_p + 2 E(u, u_p) rising, y_p - 2 E(u_p, u) falling.</p>
<p><b>Source:</b> Mayergoyz 1991, chapter 1; Everett 1955.</p>
<p><b>Smoothness:</b> the output is continuous in u, but not in the memory, which selects the branch.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>preisach(min(max(u, lo), hi), memory, lo, hi, n, E, virgin)</code> in <a href=\"modelica://HystFMU.Operators.Events.Preisach\">Operators.Events.Preisach</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Events.Preisach\">Operators.Events.Preisach</a>, <a href=\"modelica://HystFMU.Operators.Sampled.Preisach\">Operators.Sampled.Preisach</a>, which use it.</p>
</html>"));
end preisach;
