within HystFMU.Functions;
function constraintFactorSlope "Slope of the branch of the constraint-factor operator"
  extends Icons.Function;
  input Real d "Length of the branch, 0 to d_max";
  input Real a0 "Constant of the polynomial";
  input Real a[:] "Coefficients of the odd powers";
  output Real slope "g'(d)";
protected
  Real odd "Odd part divided by d";
  Real d_odd "Derivative of the odd part";
algorithm
  odd := 0;
  d_odd := 0;
  for j in 1:size(a, 1) loop
    odd := odd*(d*d) + a[size(a, 1) + 1 - j];
    d_odd := d_odd*(d*d) + (2*(size(a, 1) - j) + 1)*a[size(a, 1) + 1 - j];
  end for;
  slope := exp(-d)*(a0 + odd*d) + (1 + exp(-d))*tanh(0.5*d)*d_odd;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> g' = e<sup>-d</sup> (a0 + sum_j a_j d<sup>2j-1</sup>) + (1 - e<sup>-d</sup>) sum_j (2j - 1) a_j d<sup>2j-2</sup>.</p>
<p><b>Source:</b> derivative of Shen &amp; Ma 2017, eq. 1.</p>
<p><b>Limitations:</b> 0 &le; d &le; d_max.</p>
<p><b>Example:</b> <code>constraintFactorSlope(d, a0, a)</code> in <a href=\"modelica://HystFMU.Functions.constraintFactorInverse\">Functions.constraintFactorInverse</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.constraintFactorInverse\">Functions.constraintFactorInverse</a>, which uses it.</p>
</html>"));
end constraintFactorSlope;
