within HystFMU.Networks;
block PolynomialNarx "Polynomial of lagged inputs, auxiliary function and outputs (NFIR, NARX)"
  extends BaseClasses.PolynomialNarx(y(start = y0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real past_u[n_u + n_k](each start = 0, each fixed = true) "u_k and older inputs, newest first";
  discrete Real past_f[max(n_f + n_k, 1)](each start = 0, each fixed = true) "f_k and older ones, newest first";
  discrete Real past_y[max(n_y, 1)](each start = 0, each fixed = true) "y_(k-1) and older outputs, newest first";
equation
  assert(q <= 3, "the degree q must not be greater than 3");
  when sample(t0, Ts) then
    past_u = if not pre(begun) then fill(u, n_u + n_k) else Functions.shift(u, pre(past_u));
    past_f = if not pre(begun) then fill(f, max(n_f + n_k, 1)) else Functions.shift(f, pre(past_f));
    past_y = if not pre(begun) then fill(y0, max(n_y, 1)) else Functions.shift(pre(y), pre(past_y));
    y = Functions.polynomial(cat(1, Functions.lagged(past_u, n_k, n_u), Functions.lagged(past_f, n_k, n_f), Functions.lagged(past_y, 0, n_y)), theta, q);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> degree 3 at most (the unit: 10).</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Networks.BaseClasses.PolynomialNarx\">Networks.BaseClasses.PolynomialNarx</a>: equation, source, example.</p>
</html>"));
end PolynomialNarx;
