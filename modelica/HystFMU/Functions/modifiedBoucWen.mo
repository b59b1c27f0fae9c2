within HystFMU.Functions;
function modifiedBoucWen "State of the modified Bouc-Wen model after a ramp of the displacement"
  extends Icons.Function;
  input Real before[2] "Deflection d of the operator and z before the ramp";
  input Real v "Velocity of the piston";
  input Real Ts "Duration of the ramp";
  input Real by[3] "Weights of the velocity, of d and of z in the velocity of the dashpot in series";
  input Real A "Slope of z at z = 0";
  input Real beta "Shape of the loop, beta/(beta + gamma)";
  input Real gamma "Width of the loop, gamma/(beta + gamma)";
  input Real n "Sharpness of the knee";
  input Real z_max "Bound of z";
  output Real after[2] "Deflection and z after the ramp";
protected
  Real way = Ts*((1 - by[1])*abs(v) + by[2]*abs(before[1]) + by[3]*z_max) "Bound of the path of d";
  Real m = min(floor(4*(n*A/z_max*way + Ts*(by[2] + by[3]*A))) + 1, 400) "Number of steps";
algorithm
  after := before;
  for i in 0:19 loop
    // one call inside an if skips twenty steps
    if 20*i < m then
      after := modifiedBoucWenSteps(after, v, Ts/m, 20*i, m, by, A, beta, gamma, n, z_max);
    end if;
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> d' = v - by {v, d, z}, z' = A d' (1 - (beta + gamma sgn(d' z)) abs(z/z_max)^n), in at most 400 Runge-Kutta steps.</p>
<p><b>Source:</b> Spencer, Dyke, Sain &amp; Carlson 1997.</p>
<p><b>Limitations:</b> the velocity is constant.</p>
<p><b>Example:</b> <code>modifiedBoucWen(pre(x), v, Ts, {c_0, k_0, alpha}/(c_0 + c_1), A, beta/(beta + gamma), gamma/(beta + gamma), n, z_max)</code> in <a href=\"modelica://HystFMU.Dynamics.ModifiedBoucWen\">Dynamics.ModifiedBoucWen</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.ModifiedBoucWen\">Dynamics.ModifiedBoucWen</a>, which uses it.</p>
</html>"));
end modifiedBoucWen;
