within HystFMU.Operators.Sampled;
block BoucWen "Bouc-Wen operator, sampled"
  extends BaseClasses.BoucWen(y(start = 0, fixed = true), z(start = z0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real u_last(start = u0, fixed = true) "Input at the last sample";
equation
  assert(beta + gamma > 0, "beta + gamma must be greater than 0, else z is unbounded");
  assert((beta + gamma)*abs(z0)^n <= A, "abs(z0) must be at most (A/(beta + gamma))^(1/n)");
  when sample(t0, Ts) then
    z = Functions.boucWen(u, pre(u_last), pre(z), A, beta, gamma, n);
    u_last = u;
    y = k*(alpha*u + (1 - alpha)*z);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> for n other than 1, the operator uses an incomplete beta function.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.BoucWen\">Operators.BaseClasses.BoucWen</a>: equation, source, example.</p>
</html>"));
end BoucWen;
