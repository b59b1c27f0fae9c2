within HystFMU.Functions;
function jilesAthertonDistance "Distance of the walls from the anhysteretic curve after a path"
  extends Icons.Function;
  input Real h "Last effective field";
  input Real d "Distance of the walls at the last effective field";
  input Real s "Direction, 1 or -1";
  input Real x "Path of the effective field, at least 0";
  input Real Ms "Saturation";
  input Real a "Shape";
  input Real k "Pinning";
  output Real d_new "Distance after the path";
protected
  Real side = sqrt(0.15)*x "Distance of the outer Gauss points from the middle";
  Real ends = langevinSlope((h + s*(0.5*x - side))/a)*exp(-(0.5*x + side)/k) + langevinSlope((h + s*(0.5*x + side))/a)*exp(-(0.5*x - side)/k);
  Real middle = langevinSlope((h + s*0.5*x)/a)*exp(-0.5*x/k);
algorithm
  d_new := d*exp(-x/k) + s*x*Ms/a*(5/18*ends + 8/18*middle);
  annotation (smoothOrder = 1, Documentation(info = "<html>
<p><b>Equation:</b> dd/dx = s f'(h + s x) - d/k, f(h) = Ms L(h/a), by Gauss quadrature with three points.</p>
<p><b>Source:</b> Jiles &amp; Atherton, J. Magn. Magn. Mater. 61 (1986) 48-60.</p>
<p><b>Limitations:</b> x must be at most a and at most k.</p>
<p><b>Example:</b> <code>jilesAthertonDistance(h, d, s, x, Ms, a, k)</code> in <a href=\"modelica://HystFMU.Functions.jilesAthertonStep\">Functions.jilesAthertonStep</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.jilesAthertonStep\">Functions.jilesAthertonStep</a>, which uses it.</p>
</html>"));
end jilesAthertonDistance;
