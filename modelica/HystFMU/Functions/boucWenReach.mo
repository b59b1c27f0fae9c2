within HystFMU.Functions;
function boucWenReach "Hysteretic part after a path of the input from v = 0"
  extends Icons.Function;
  input Real way "Path from v = 0, at least 0";
  input Real A "Slope at v = 0";
  input Real c "Coefficient in dv/dxi = A - c v^n, not 0";
  input Real n "Sharpness of the knee, greater than 1";
  output Real v "Hysteretic part times the direction";
protected
  Real V = (A/abs(c))^(1/n) "Scale of v";
  Real e = if c < 0 then 1 - 1/n else 0 "Exponent of s";
  Real g_half = 0.5^(1/n) "g = r^(1/n) at the middle, r = s = 0.5";
  Real U_half = if e > 0 then (0.5^e - 1)/e else log(0.5) "U at the middle, r = s = 0.5";
  Real half = g_half*(1 + betaSeries(1 - e, 0.5, n, 1)) "Path to the middle, in units of V/A";
  Real xi = way*A/V;
  Real target = boucWenBeyond(U_half, e, n) - n*(xi - half);
  Real g = min(xi, g_half) "Unknown of Newton's method up to the middle";
  Real U = U_half "Unknown of Newton's method beyond the middle";
  Real s = 0.5;
algorithm
  // Newton's method on convex functions with derivatives from 1 to 2: five steps are enough
  if xi <= half then
    for i in 1:6 loop
      g := min(g + (xi - g*(1 + betaSeries(1 - e, g^n, n, 1)))*(1 - g^n)^(1 - e), g_half);
    end for;
    v := if c < 0 then V*g*(1 - g^n)^(-1/n) else V*g;
  else
    for i in 1:6 loop
      U := min(U - (boucWenBeyond(U, e, n) - target)*(1 - boucWenMissing(U, e))^(1 - 1/n), U_half);
    end for;
    s := boucWenMissing(U, e);
    v := if c < 0 then V*(1/s - 1)^(1/n) else V*(1 - s)^(1/n);
  end if;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> the inverse of boucWenWay, by Newton's method.</p>
<p><b>Source:</b> Ikhouane &amp; Rodellar, Systems with Hysteresis, 2007, chapter 2; series: Abramowitz &amp; Stegun 1964, 6.6.8 and 15.1.1.</p>
<p><b>Limitations:</b> n &gt; 1; n - 1 &gt; 1e-4 for full accuracy.</p>
<p><b>Example:</b> <code>boucWenReach(to_zero - way, A, c, n)</code> in <a href=\"modelica://HystFMU.Functions.boucWen\">Functions.boucWen</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.boucWen\">Functions.boucWen</a>, which uses it.</p>
</html>"));
end boucWenReach;
