within HystFMU.Functions;
function boucWenMissing "Distance of the Bouc-Wen operator from saturation, relative to saturation"
  extends Icons.Function;
  input Real U "(s^e - 1)/e, or log(s) for e = 0";
  input Real e "Exponent of s: 0 or 1 - 1/n";
  output Real s "Relative distance from saturation";
protected
  Real one = 1 + e*U "s^e";
algorithm
  // log(1 + x) = x log(1 + x)/((1 + x) - 1), rounded alike
  s := if one == 1 then exp(U) else exp(U*log(one)/(one - 1));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> s = (1 + e U)<sup>1/e</sup>, exp(U) for e = 0.</p>
<p><b>Source:</b> Box &amp; Cox 1964; log(1 + x) of small x: Kahan.</p>
<p><b>Limitations:</b> 0 &le; e &lt; 1.</p>
<p><b>Example:</b> <code>boucWenMissing(U, e)</code> in <a href=\"modelica://HystFMU.Functions.boucWenBeyond\">Functions.boucWenBeyond</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.boucWenBeyond\">Functions.boucWenBeyond</a>, <a href=\"modelica://HystFMU.Functions.boucWenReach\">Functions.boucWenReach</a>, which use it.</p>
</html>"));
end boucWenMissing;
