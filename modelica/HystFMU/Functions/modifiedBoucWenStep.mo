within HystFMU.Functions;
function modifiedBoucWenStep "Runge-Kutta step of the modified Bouc-Wen model"
  extends Icons.Function;
  input Real before[2] "Deflection of the operator and z";
  input Real v "Velocity of the piston";
  input Real h "Length of the step";
  input Real by[3] "Weights of the velocity, of d and of z in the velocity of the dashpot in series";
  input Real A "Slope of z at z = 0";
  input Real beta "Shape of the loop, beta/(beta + gamma)";
  input Real gamma "Width of the loop, gamma/(beta + gamma)";
  input Real n "Sharpness of the knee";
  input Real z_max "Bound of z";
  output Real after[2] "Deflection and z after the step";
protected
  Real k_1[2];
  Real k_2[2];
  Real k_3[2];
  Real k_4[2];
algorithm
  k_1 := modifiedBoucWenRate(before, v, by, A, beta, gamma, n, z_max);
  k_2 := modifiedBoucWenRate(before + 0.5*h*k_1, v, by, A, beta, gamma, n, z_max);
  k_3 := modifiedBoucWenRate(before + 0.5*h*k_2, v, by, A, beta, gamma, n, z_max);
  k_4 := modifiedBoucWenRate(before + h*k_3, v, by, A, beta, gamma, n, z_max);
  after := before + h/6*(k_1 + 2*(k_2 + k_3) + k_4);
  after[2] := max(-z_max, min(z_max, after[2]));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> Runge-Kutta rule of order 4; z stays between -z_max and z_max.</p>
<p><b>Source:</b> Spencer, Dyke, Sain &amp; Carlson 1997.</p>
<p><b>Limitations:</b> h must be shorter than the time constants.</p>
<p><b>Example:</b> <code>modifiedBoucWenStep(after, v, h, by, A, beta, gamma, n, z_max)</code> in <a href=\"modelica://HystFMU.Functions.modifiedBoucWenSteps\">Functions.modifiedBoucWenSteps</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.modifiedBoucWenSteps\">Functions.modifiedBoucWenSteps</a>, which uses it.</p>
</html>"));
end modifiedBoucWenStep;
