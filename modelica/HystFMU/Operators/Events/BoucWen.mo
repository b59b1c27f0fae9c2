within HystFMU.Operators.Events;
block BoucWen "Bouc-Wen operator, events at reversals"
  extends BaseClasses.BoucWen(final usesRate = true);
  extends Interfaces.Reversals;
protected
  discrete Real u_turn(start = 0, fixed = true) "Input at the last reversal";
  discrete Real z_turn(start = z0, fixed = true) "z there";
equation
  connect(du, rate);
  assert(beta + gamma > 0, "beta + gamma must be greater than 0: z would grow without bound");
  assert((beta + gamma)*abs(z0)^n <= A, "z0 must be within (A/(beta + gamma))^(1/n), the bound of z");
  when {initial(), change(rising)} then
    z_turn = if initial() then z0 else Functions.boucWen(u, pre(u_turn), pre(z_turn), A, beta, gamma, n);
    u_turn = u;
  end when;
  z = Functions.boucWen(u, u_turn, z_turn, A, beta, gamma, n);
  y = k*(alpha*u + (1 - alpha)*z);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> z' = A u' - beta abs(u') abs(z)<sup>n-1</sup> z - gamma u' abs(z)<sup>n</sup>, y = k (alpha u + (1 - alpha) z), integrated in u: the operator does not depend on the rate.</p>
<p><b>Source:</b> Wen, J. Eng. Mech. Div. 102 (1976) 249-263; Ikhouane &amp; Rodellar, Systems with Hysteresis, 2007, chapter 2.</p>
<p><b>Limitations:</b> One event for each reversal of the input, in between a closed form of the input: exact whatever the solver's step; for n other than 1 by an incomplete beta function. A jump of the input must be a ramp, because the rate tells where it turns; only the sign of the rate is used.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.BoucWen\">Operators.Sampled.BoucWen</a>, <a href=\"modelica://HystFMU.Operators.Smooth.BoucWen\">Operators.Smooth.BoucWen</a>, <a href=\"modelica://HystFMU.Validation.Events.BoucWen\">Validation.Events.BoucWen</a>.</p>
</html>"));
end BoucWen;
