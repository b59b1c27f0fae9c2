within HystFMU.Functions;
function constraintFactorBranch "Branch function of the constraint-factor operator"
  extends Icons.Function;
  input Real d "Length of the branch, at least 0";
  input Real a0 "Constant of the polynomial";
  input Real a[:] "Coefficients of the odd powers";
  input Real d_max "Longest branch of the polynomial";
  output Real g "Height of the branch";
protected
  Real e = min(d, d_max) "Argument of the polynomial";
  Real factor = (1 + exp(-e))*tanh(0.5*e) "1 - exp(-e), accurate also for short branches";
  Real odd;
  Real slope "Slope of the polynomial part with respect to d";
algorithm
  odd := 0;
  slope := 0;
  for j in 1:size(a, 1) loop
    odd := odd*(e*e) + a[size(a, 1) + 1 - j];
    slope := slope*(e*e) + (2*(size(a, 1) - j) + 1)*a[size(a, 1) + 1 - j];
  end for;
  g := factor*(a0 + odd*e);
  // a straight line beyond d_max
  g := g + (exp(-e)*(a0 + odd*e) + factor*slope)*(d - e);
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> g(d) = (1 - e<sup>-d</sup>) (a0 + sum_j a_j d<sup>2j-1</sup>), and a straight line with the slope at d_max beyond d_max.</p>
<p><b>Source:</b> Shen &amp; Ma 2017, eq. 1.</p>
<p><b>Limitations:</b> d &ge; 0.</p>
<p><b>Example:</b> <code>constraintFactorBranch(d_max, a0, a, d_max)</code> in <a href=\"modelica://HystFMU.Functions.constraintFactorInverse\">Functions.constraintFactorInverse</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.constraintFactor\">Functions.constraintFactor</a>, <a href=\"modelica://HystFMU.Functions.constraintFactorLoading\">Functions.constraintFactorLoading</a>, which use it.</p>
</html>"));
end constraintFactorBranch;
