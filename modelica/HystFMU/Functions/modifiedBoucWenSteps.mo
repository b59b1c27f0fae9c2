within HystFMU.Functions;
function modifiedBoucWenSteps "Twenty steps of the modified Bouc-Wen model"
  extends Icons.Function;
  input Real before[2] "Deflection of the operator and z before the first of these steps";
  input Real v "Velocity of the piston";
  input Real h "Length of a step";
  input Integer first "Number of steps before the first of these steps";
  input Real m "Number of all steps";
  input Real by[3] "Weights of the velocity, of d and of z in the velocity of the dashpot in series";
  input Real A "Slope of z at z = 0";
  input Real beta "Shape of the loop, beta/(beta + gamma)";
  input Real gamma "Width of the loop, gamma/(beta + gamma)";
  input Real n "Sharpness of the knee";
  input Real z_max "Bound of z";
  output Real after[2] "Deflection and z after the steps";
algorithm
  after := before;
  for i in 0:19 loop
    if first + i < m then
      after := modifiedBoucWenStep(after, v, h, by, A, beta, gamma, n, z_max);
    end if;
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> up to twenty steps of modifiedBoucWenStep.</p>
<p><b>Source:</b> Spencer, Dyke, Sain &amp; Carlson 1997.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>modifiedBoucWenSteps(after, v, Ts/m, 20*i, m, by, A, beta, gamma, n, z_max)</code> in <a href=\"modelica://HystFMU.Functions.modifiedBoucWen\">Functions.modifiedBoucWen</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.modifiedBoucWen\">Functions.modifiedBoucWen</a>, which uses it.</p>
</html>"));
end modifiedBoucWenSteps;
