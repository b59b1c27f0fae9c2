within HystFMU.Functions;
function kernelRate "Rate of a Krasnosel'skii-Pokrovskii kernel with a rounded corner"
  extends Icons.Function;
  input Real u "Input";
  input Real du "Its rate";
  input Real a "Rise length of the ridge function";
  input Real p1 "Where the falling ramp is -1";
  input Real p2 "Where the rising ramp leaves -1";
  input Real k "Kernel";
  input Real width "Value on which the corner is rounded";
  output Real dk "Rate of the kernel";
protected
  Real rising = 2*(u - p2)/a - 1 "Rising ramp before its limits";
  Real falling = 2*(u - p1)/a - 1 "Falling ramp before its limits";
algorithm
  dk := 2/a*((if abs(rising) <= 1 then max(du, 0)*min(max(1 + (rising - k)/width, 0), 1) else 0) + (if abs(falling) <= 1 then min(du, 0)*min(max(1 + (k - falling)/width, 0), 1) else 0));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> k' = 2/a (max(u', 0) S((ridge(u - p2) - k)/width) + min(u', 0) S((k - ridge(u - p1))/width)) within the ramps, 0 outside, S(x) = min(max(1 + x, 0), 1).</p>
<p><b>Source:</b> the kernel as a generalised play (Krasnosel'skii &amp; Pokrovskii 1989, chapter 2), its corner rounded.</p>
<p><b>Smoothness:</b> a rate, which jumps where a ramp begins and ends.</p>
<p><b>Limitations:</b> the distance to the exact kernel stays within width.</p>
<p><b>Example:</b> <code>kernelRate(u, rate, a, p1[i], p2[i], k[i], width)</code> in <a href=\"modelica://HystFMU.Operators.Smooth.KrasnoselskiiPokrovskii\">Operators.Smooth.KrasnoselskiiPokrovskii</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Smooth.KrasnoselskiiPokrovskii\">Operators.Smooth.KrasnoselskiiPokrovskii</a>, which uses it.</p>
</html>"));
end kernelRate;
