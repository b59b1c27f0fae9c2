within HystFMU.Functions;
function constraintFactorInverse "Branch of the inverse constraint-factor operator"
  extends Icons.Function;
  input Real h "Wanted output of the operator";
  input Real origin[3] "Start and scale of the branch, from branchOrigin";
  input Real a0 "Constant of the polynomial";
  input Real a[:] "Coefficients of the odd powers";
  input Real d_max "Longest branch of the polynomial";
  output Real x "Input of the operator";
protected
  Real v = origin[3]*abs(h - origin[1]) "Height of the branch";
  Real edge = constraintFactorBranch(d_max, a0, a, d_max) "g at d_max";
  Real lo "Lower bound of d, where g < v";
  Real hi "Upper bound of d, where g > v";
  Real d "Solution of g(d) = v";
  Real g;
  Real next;
algorithm
  lo := 0;
  hi := d_max;
  d := d_max*min(v/edge, 1);
  for i in 1:12 loop
    // Newton's method, with bisection if it leaves the bracket
    g := constraintFactorBranch(d, a0, a, d_max) - v;
    lo := if g <= 0 then d else lo;
    hi := if g > 0 then d else hi;
    next := d - g/max(constraintFactorSlope(d, a0, a), 1e-300);
    d := if g == 0 then d elseif next >= lo and next <= hi then next else 0.5*(lo + hi);
  end for;
  d := if v > edge then d_max + (v - edge)/constraintFactorSlope(d_max, a0, a) else d;
  x := origin[2] + (if h >= origin[1] then 1 else -1)*d/origin[3];
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> x = x_p + sgn(h - h_p) g<sup>-1</sup>(s abs(h - h_p))/s.</p>
<p><b>Source:</b> Shen &amp; Ma 2017, eq. 1-2, solved for x; bracketed Newton's method.</p>
<p><b>Limitations:</b> the branch must rise between 0 and d_max.</p>
<p><b>Example:</b> <code>constraintFactorInverse(h, Functions.branchOrigin(extrema, 0, x0, 2), a0, a, d_max)</code> in <a href=\"modelica://HystFMU.Inverse.Events.ConstraintFactorInverse\">Inverse.Events.ConstraintFactorInverse</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Events.ConstraintFactorInverse\">Inverse.Events.ConstraintFactorInverse</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.ConstraintFactorInverse\">Inverse.Sampled.ConstraintFactorInverse</a>, which use it.</p>
</html>"));
end constraintFactorInverse;
