within HystFMU.Operators.Events;
block BoucWen "Bouc-Wen operator, events at reversals"
  extends BaseClasses.BoucWen(final usesRate = true);
  extends Interfaces.Reversals(eps = 1e-9*(A/(beta + gamma))^(1/n)/A);
protected
  discrete Real u_turn(start = u0, fixed = true) "Input at the last reversal";
  discrete Real z_turn(start = z0, fixed = true) "z at the last reversal";
equation
  connect(du, rate) annotation (Line(points = {{-110, -70}, {-80, -70}}, color = {0, 0, 127}));
  assert(beta + gamma > 0, "beta + gamma must be greater than 0, else z is unbounded");
  assert((beta + gamma)*abs(z0)^n <= A, "abs(z0) must be at most (A/(beta + gamma))^(1/n)");
  when {initial(), change(rising)} then
    z_turn = if initial() then Functions.boucWen(u, u0, z0, A, beta, gamma, n) else Functions.boucWen(u, pre(u_turn), pre(z_turn), A, beta, gamma, n);
    u_turn = u;
  end when;
  z = Functions.boucWen(u, u_turn, z_turn, A, beta, gamma, n);
  y = k*(alpha*u + (1 - alpha)*z);
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> for n other than 1, the operator uses an incomplete beta function.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.BoucWen\">Operators.BaseClasses.BoucWen</a>: equation, source, example.</p>
</html>"));
end BoucWen;
