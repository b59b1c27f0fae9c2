within HystFMU.Functions;
function boucWenBeyond "Path function of the Bouc-Wen operator beyond the middle of the curve"
  extends Icons.Function;
  input Real U "(s^e - 1)/e, or log(s) for e = 0, with s = 1 - share of saturation";
  input Real e "Exponent of s: 0 or 1 - 1/n";
  input Real n "Sharpness of the knee";
  output Real f "Function that decreases by n times the path; df/dU = (1 - s)^(1/n - 1)";
protected
  Real s = boucWenMissing(U, e);
algorithm
  f := U + s^e*betaSeries(1 - 1/n, s, 1, e);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> f = U + s<sup>e</sup> sum over k &ge; 1 of (1 - 1/n)<sub>k</sub>/k! s<sup>k</sup>/(k + e).</p>
<p><b>Source:</b> Ikhouane &amp; Rodellar, Systems with Hysteresis, 2007, chapter 2; series: Abramowitz &amp; Stegun 1964, 6.6.8 and 15.1.1.</p>
<p><b>Limitations:</b> s &le; 0.5.</p>
<p><b>Example:</b> <code>boucWenBeyond(U_half, e, n)</code> in <a href=\"modelica://HystFMU.Functions.boucWenReach\">Functions.boucWenReach</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.boucWenReach\">Functions.boucWenReach</a>, <a href=\"modelica://HystFMU.Functions.boucWenWay\">Functions.boucWenWay</a>, which use it.</p>
</html>"));
end boucWenBeyond;
