within HystFMU.Functions;
function kernelRate "Rate of a Krasnosel'skii-Pokrovskii kernel with rounded corners"
  extends Icons.Function;
  input Real u "Input";
  input Real du "Rate of the input";
  input Real a "Rise length of the ridge function";
  input Real p1 "Input at which the falling ramp reaches -1";
  input Real p2 "Input at which the rising ramp leaves -1";
  input Real k "Kernel";
  input Real width "Width of the rounded corners";
  output Real dk "Rate of the kernel";
protected
  Real beyond = min(max(1 + (2*(u - p2)/a - 1 - k)/width, 0), 1) "Rounded step: 1 if the rising ramp is above the kernel";
  Real below = min(max(1 + (k - 2*(u - p1)/a + 1)/width, 0), 1) "Rounded step: 1 if the falling ramp is below the kernel";
  Real up = min(max((1 - k)/width, 0), 1) "Rounded step: 0 if the kernel is at its maximum";
  Real down = min(max((1 + k)/width, 0), 1) "Rounded step: 0 if the kernel is at its minimum";
algorithm
  dk := 2/a*(max(du, 0)*beyond^2*(3 - 2*beyond)*up^2*(3 - 2*up) + min(du, 0)*below^2*(3 - 2*below)*down^2*(3 - 2*down));
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> k' = 2/a (max(u', 0) S(1 + (2 (u - p2)/a - 1 - k)/width) S((1 - k)/width) + min(u', 0) S(1 + (k - 2 (u - p1)/a + 1)/width) S((1 + k)/width)), S(x) = x^2 (3 - 2 x) between its limits 0 and 1.</p>
<p><b>Source:</b> the kernel as a generalised play (Krasnosel'skii &amp; Pokrovskii 1989, chapter 2), its corners rounded.</p>
<p><b>Smoothness:</b> the rate is differentiable except at reversals of u. Where a rate is not differentiable, the error of an explicit solver is up to 400 times its tolerance, and an implicit solver may fail.</p>
<p><b>Limitations:</b> the distance to the exact kernel is at most width.</p>
<p><b>Example:</b> <code>kernelRate(u, rate, a, p1[i], p2[i], k[i], width)</code> in <a href=\"modelica://HystFMU.Operators.Smooth.KrasnoselskiiPokrovskii\">Operators.Smooth.KrasnoselskiiPokrovskii</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Smooth.KrasnoselskiiPokrovskii\">Operators.Smooth.KrasnoselskiiPokrovskii</a>, which uses it.</p>
</html>"));
end kernelRate;
