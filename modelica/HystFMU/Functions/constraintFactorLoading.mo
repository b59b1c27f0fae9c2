within HystFMU.Functions;
function constraintFactorLoading "Initial loading curve of the constraint-factor operator"
  extends Icons.Function;
  input Real q[:] "Inputs, at least 0";
  input Real a0 "Constant of the polynomial";
  input Real a[:] "Coefficients of the odd powers";
  input Real d_max "Longest branch of the polynomial";
  output Real phi[size(q, 1)] "Outputs";
algorithm
  for i in 1:size(q, 1) loop
    phi[i] := 0.5*constraintFactorBranch(2*q[i], a0, a, d_max);
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> phi(q) = g(2 q)/2.</p>
<p><b>Source:</b> Masing's rule; Shen &amp; Ma 2017, eq. 1.</p>
<p><b>Limitations:</b> q &ge; 0.</p>
<p><b>Example:</b> <code>constraintFactorLoading(q, a0, a, d_max)</code> in <a href=\"modelica://HystFMU.Operators.Smooth.ConstraintFactor\">Operators.Smooth.ConstraintFactor</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Smooth.ConstraintFactor\">Operators.Smooth.ConstraintFactor</a>, which uses it.</p>
</html>"));
end constraintFactorLoading;
