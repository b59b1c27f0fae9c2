within HystFMU.Operators.Sampled;
block BoucWen "Bouc-Wen operator, sampled"
  extends BaseClasses.BoucWen(y(start = 0, fixed = true), z(start = z0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real u_last(start = 0, fixed = true) "Input at the last sample";
equation
  assert(beta + gamma > 0, "beta + gamma must be greater than 0: z would grow without bound");
  assert((beta + gamma)*abs(z0)^n <= A, "z0 must be within (A/(beta + gamma))^(1/n), the bound of z");
  when sample(0, Ts) then
    z = if time < 0.5*Ts then z0 else Functions.boucWen(u, pre(u_last), pre(z), A, beta, gamma, n);
    u_last = u;
    y = k*(alpha*u + (1 - alpha)*z);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> z' = A u' - beta abs(u') abs(z)<sup>n-1</sup> z - gamma u' abs(z)<sup>n</sup>, y = k (alpha u + (1 - alpha) z), integrated in u: the operator does not depend on the rate.</p>
<p><b>Source:</b> Wen, J. Eng. Mech. Div. 102 (1976) 249-263; Ikhouane &amp; Rodellar, Systems with Hysteresis, 2007, chapter 2.</p>
<p><b>Limitations:</b> Acts at 0, Ts, 2 Ts, ...: the unit of the same name stepped with Ts; extrema between two samples are not seen; for n other than 1 by an incomplete beta function. The simulation must start at time 0.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Events.BoucWen\">Operators.Events.BoucWen</a>, <a href=\"modelica://HystFMU.Operators.Smooth.BoucWen\">Operators.Smooth.BoucWen</a>, <a href=\"modelica://HystFMU.Validation.Sampled.BoucWen\">Validation.Sampled.BoucWen</a>.</p>
</html>"));
end BoucWen;
