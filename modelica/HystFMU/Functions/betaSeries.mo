within HystFMU.Functions;
function betaSeries "Series of the incomplete beta function after its first term"
  extends Icons.Function;
  input Real m "Exponent of 1/(1 - x)";
  input Real x "Variable";
  input Real d "Denominator of term k: k d + o";
  input Real o "Constant o in the denominator";
  output Real sum "Sum of the terms from k = 1";
protected
  Real term "(m)_k/k! x^k";
algorithm
  sum := 0;
  term := 1;
  for k in 1:52 loop
    term := term*(m + k - 1)/k*x;
    sum := sum + term/(k*d + o);
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> sum over k &ge; 1 of (m)<sub>k</sub>/k! x<sup>k</sup>/(k d + o).</p>
<p><b>Source:</b> Abramowitz &amp; Stegun 1964, 6.6.8 and 15.1.1.</p>
<p><b>Limitations:</b> 0 &le; x &le; 0.5 and 0 &le; m &le; 1: the remainder of the series is less than 2<sup>-52</sup>.</p>
<p><b>Example:</b> <code>betaSeries(1 - e, r, n, 1)</code> in <a href=\"modelica://HystFMU.Functions.boucWenWay\">Functions.boucWenWay</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.boucWenBeyond\">Functions.boucWenBeyond</a>, <a href=\"modelica://HystFMU.Functions.boucWenReach\">Functions.boucWenReach</a>, <a href=\"modelica://HystFMU.Functions.boucWenWay\">Functions.boucWenWay</a>, which use it.</p>
</html>"));
end betaSeries;
