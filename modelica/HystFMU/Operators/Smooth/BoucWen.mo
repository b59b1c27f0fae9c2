within HystFMU.Operators.Smooth;
block BoucWen "Bouc-Wen operator, smooth"
  extends BaseClasses.BoucWen(final usesRate = true);
  extends Interfaces.Rated;
initial equation
  z = Functions.boucWen(u, u0, z0, A, beta, gamma, n);
equation
  connect(du, rate) annotation (Line(points = {{-110, -70}, {-80, -70}}, color = {0, 0, 127}));
  assert(beta + gamma > 0, "beta + gamma must be greater than 0, else z is unbounded");
  assert((beta + gamma)*abs(z0)^n <= A, "abs(z0) must be at most (A/(beta + gamma))^(1/n)");
  der(z) = Functions.boucWenRate(rate, z, A, beta, gamma, n);
  y = k*(alpha*u + (1 - alpha)*z);
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> for n other than 1, the operator uses an incomplete beta function.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.BoucWen\">Operators.BaseClasses.BoucWen</a>: equation, source, example.</p>
</html>"));
end BoucWen;
