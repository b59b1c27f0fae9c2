within HystFMU.Functions;
function constraintFactor "Branch of the constraint-factor operator"
  extends Icons.Function;
  input Real x "Input";
  input Real origin[3] "Start and scale of the branch, from branchOrigin";
  input Real a0 "Constant of the polynomial";
  input Real a[:] "Coefficients of the odd powers";
  input Real d_max "Longest branch of the polynomial";
  output Real h "Operator output";
algorithm
  h := origin[2] + (if x >= origin[1] then 1 else -1)*constraintFactorBranch(origin[3]*abs(x - origin[1]), a0, a, d_max)/origin[3];
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> h = h_p + sgn(x - x_p) g(s abs(x - x_p))/s.</p>
<p><b>Source:</b> Shen &amp; Ma 2017, eq. 1-2.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>constraintFactor(x, Functions.branchOrigin(extrema, x0, 0, virgin), a0, a, d_max)</code> in <a href=\"modelica://HystFMU.Operators.Events.ConstraintFactor\">Operators.Events.ConstraintFactor</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Events.ConstraintFactor\">Operators.Events.ConstraintFactor</a>, <a href=\"modelica://HystFMU.Operators.Sampled.ConstraintFactor\">Operators.Sampled.ConstraintFactor</a>, which use it.</p>
</html>"));
end constraintFactor;
