within HystFMU.Functions;
function boucWenRate "Rate of the hysteretic part"
  extends Icons.Function;
  input Real du "Rate of the input";
  input Real z "Hysteretic part";
  input Real A "Slope of z at z = 0";
  input Real beta "Width of the loop";
  input Real gamma "Shape of the loop";
  input Real n "Sharpness of the knee";
  output Real dz "Rate of z";
algorithm
  dz := A*du - (beta*abs(du)*(if z >= 0 then 1 else -1) + gamma*du)*min(abs(z)^n, A/(beta + gamma));
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> z' = A u' - beta abs(u') abs(z)<sup>n-1</sup> z - gamma u' abs(z)<sup>n</sup>, with abs(z)<sup>n</sup> limited to A/(beta + gamma). The exact z never exceeds this limit, but trial steps of a solver may exceed it and overflow for a large n.</p>
<p><b>Source:</b> Wen, J. Eng. Mech. Div. 102 (1976) 249-263.</p>
<p><b>Limitations:</b> n &ge; 1, beta + gamma &gt; 0.</p>
<p><b>Example:</b> <code>boucWenRate(rate, z, A, beta, gamma, n)</code> in <a href=\"modelica://HystFMU.Operators.Smooth.BoucWen\">Operators.Smooth.BoucWen</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Smooth.BoucWen\">Operators.Smooth.BoucWen</a>, which uses it.</p>
</html>"));
end boucWenRate;
