within HystFMU.Functions;
function boucWenWay "Path of the input from v = 0 to v"
  extends Icons.Function;
  input Real v "Hysteretic part times the direction, at least 0";
  input Real A "Slope at v = 0";
  input Real c "Coefficient in dv/dxi = A - c v^n, not 0";
  input Real n "Sharpness of the knee, greater than 1";
  output Real way "Way";
protected
  Real V = (A/abs(c))^(1/n) "Scale of v";
  Real e = if c < 0 then 1 - 1/n else 0 "Exponent of s";
  Real q = (v/V)^n;
  Real r = if c < 0 then q/(1 + q) else q "Share of saturation";
  Real s = if c < 0 then 1/(1 + q) else max(1 - q, 1e-17) "Relative distance from saturation";
  Real U = if e > 0 then (s^e - 1)/e else log(s);
  Real U_half = if e > 0 then (0.5^e - 1)/e else log(0.5) "U at the middle, r = s = 0.5";
algorithm
  if r <= 0.5 then
    way := r^(1/n)*(1 + betaSeries(1 - e, r, n, 1));
  else
    way := 0.5^(1/n)*(1 + betaSeries(1 - e, 0.5, n, 1)) + (boucWenBeyond(U_half, e, n) - boucWenBeyond(U, e, n))/n;
  end if;
  way := V/A*way;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> n A/V dxi = r<sup>1/n-1</sup> s<sup>e-1</sup> dr, s = 1 - r, r = q for c &gt; 0 and q/(1 + q), e = 1 - 1/n for c &lt; 0, q = (v/V)<sup>n</sup>, V = (A/abs(c))<sup>1/n</sup>: for r &le; 0.5 a series in r, otherwise a series in s.</p>
<p><b>Source:</b> Ikhouane &amp; Rodellar, Systems with Hysteresis, 2007, chapter 2; series: Abramowitz &amp; Stegun 1964, 6.6.8 and 15.1.1.</p>
<p><b>Limitations:</b> n &gt; 1; n - 1 &gt; 1e-4 for full accuracy.</p>
<p><b>Example:</b> <code>boucWenWay(-v, A, c, n)</code> in <a href=\"modelica://HystFMU.Functions.boucWen\">Functions.boucWen</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.boucWen\">Functions.boucWen</a>, which uses it.</p>
</html>"));
end boucWenWay;
