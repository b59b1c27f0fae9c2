within HystFMU.Networks;
block PolynomialNarx "Polynomial network of lagged inputs, auxiliary function and outputs (NFIR, NARX)"
  extends Icons.Block;
  extends Interfaces.Sampled;
  parameter Integer n_u(min = 1) = 1 "Lags of u";
  parameter Integer n_f(min = 0) = 1 "Lags of f";
  parameter Integer n_y(min = 0) = 1 "Lags of y";
  parameter Integer q(min = 1) = 2 "Highest degree of a monomial, at most 3";
  parameter Integer n_k(min = 0) = 1 "First lag of u and f: 0 direct feed-through, 1 none";
  parameter Real theta[if q == 1 then n_u + n_f + n_y + 1 elseif q == 2 then div((n_u + n_f + n_y + 1)*(n_u + n_f + n_y + 2), 2) else div((n_u + n_f + n_y + 1)*(n_u + n_f + n_y + 2)*(n_u + n_f + n_y + 3), 6)] = fill(0.05, if q == 1 then n_u + n_f + n_y + 1 elseif q == 2 then div((n_u + n_f + n_y + 1)*(n_u + n_f + n_y + 2), 2) else div((n_u + n_f + n_y + 1)*(n_u + n_f + n_y + 2)*(n_u + n_f + n_y + 3), 6)) "Weights of the monomials, by degree, the constant last";
  parameter Real y0 = 0 "Output before the first input";
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, 50}, {-100, 70}})));
  Interfaces.RealInput f "Auxiliary function of the input" annotation (Placement(transformation(extent = {{-120, -70}, {-100, -50}})));
  Interfaces.RealOutput y(start = y0, fixed = true) "Output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  discrete Real past_u[n_u + n_k](each start = 0, each fixed = true) "u_k and older ones, newest first";
  discrete Real past_f[max(n_f + n_k, 1)](each start = 0, each fixed = true) "f_k and older ones, newest first";
  discrete Real past_y[max(n_y, 1)](each start = 0, each fixed = true) "y_(k-1) and older ones, newest first";
equation
  assert(q <= 3, "the degree q must not be greater than 3");
  when sample(0, Ts) then
    past_u = if time < 0.5*Ts then fill(u, n_u + n_k) else Functions.shift(u, pre(past_u));
    past_f = if time < 0.5*Ts then fill(f, max(n_f + n_k, 1)) else Functions.shift(f, pre(past_f));
    past_y = if time < 0.5*Ts then fill(y0, max(n_y, 1)) else Functions.shift(pre(y), pre(past_y));
    y = Functions.polynomial(cat(1, Functions.lagged(past_u, n_k, n_u), Functions.lagged(past_f, n_k, n_f), Functions.lagged(past_y, 0, n_y)), theta, q);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y_k = theta' phi(k), phi the monomials up to degree q of lags of u, f and y.</p>
<p><b>Source:</b> IPMC hysteresis model with basis function network, eq. 8-12; Leontaritis &amp; Billings 1985 (NARX).</p>
<p><b>Limitations:</b> degree 3 at most (the unit goes to 10); the simulation must start at time 0.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.PolynomialNarx\">Validation.PolynomialNarx</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Networks.Mlp\">Networks.Mlp</a>, <a href=\"modelica://HystFMU.Functions.polynomial\">Functions.polynomial</a>.</p>
</html>"));
end PolynomialNarx;
