within HystFMU.Operators.Smooth;
block BoucWen "Bouc-Wen operator, smooth"
  extends BaseClasses.BoucWen(final usesRate = true);
  extends Interfaces.Rated;
initial equation
  z = z0;
equation
  connect(du, rate);
  assert(beta + gamma > 0, "beta + gamma must be greater than 0: z would grow without bound");
  assert((beta + gamma)*abs(z0)^n <= A, "z0 must be within (A/(beta + gamma))^(1/n), the bound of z");
  der(z) = Functions.boucWenRate(rate, z, A, beta, gamma, n);
  y = k*(alpha*u + (1 - alpha)*z);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> z' = A u' - beta abs(u') abs(z)<sup>n-1</sup> z - gamma u' abs(z)<sup>n</sup>, y = k (alpha u + (1 - alpha) z), integrated in u: the operator does not depend on the rate.</p>
<p><b>Source:</b> Wen, J. Eng. Mech. Div. 102 (1976) 249-263; Ikhouane &amp; Rodellar, Systems with Hysteresis, 2007, chapter 2.</p>
<p><b>Limitations:</b> An ordinary differential equation without events, driven by the rate of the input; for n other than 1 by an incomplete beta function.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.BoucWen\">Operators.Sampled.BoucWen</a>, <a href=\"modelica://HystFMU.Operators.Events.BoucWen\">Operators.Events.BoucWen</a>, <a href=\"modelica://HystFMU.Validation.Smooth.BoucWen\">Validation.Smooth.BoucWen</a>.</p>
</html>"));
end BoucWen;
