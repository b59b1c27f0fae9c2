within HystFMU.Functions;
function modifiedBoucWenRate "Derivatives of the states of the modified Bouc-Wen model"
  extends Icons.Function;
  input Real x[2] "Deflection of the operator and z";
  input Real v "Velocity of the piston";
  input Real by[3] "Weights of the velocity, of d and of z in the velocity of the dashpot in series";
  input Real A "Slope of z at z = 0";
  input Real beta "Shape of the loop, beta/(beta + gamma)";
  input Real gamma "Width of the loop, gamma/(beta + gamma)";
  input Real n "Sharpness of the knee";
  input Real z_max "Bound of z";
  output Real rate[2] "Derivatives of the deflection and of z";
protected
  Real z = max(-z_max, min(z_max, x[2])) "z within its bound";
  Real slip = v - by*{v, x[1], z} "Derivative of the deflection";
algorithm
  rate := {slip, A*slip*(1 - (beta + gamma*sign(slip)*sign(z))*(abs(z)/z_max)^n)};
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> d' = v - by {v, d, z}, z' = A d' (1 - (beta + gamma sgn(d' z)) abs(z/z_max)^n).</p>
<p><b>Source:</b> Spencer, Dyke, Sain &amp; Carlson 1997.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>modifiedBoucWenRate(before, v, by, A, beta, gamma, n, z_max)</code> in <a href=\"modelica://HystFMU.Functions.modifiedBoucWenStep\">Functions.modifiedBoucWenStep</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.modifiedBoucWenStep\">Functions.modifiedBoucWenStep</a>, which uses it.</p>
</html>"));
end modifiedBoucWenRate;
