// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model PolynomialNfir "Polynomial network of degree 3 without lagged outputs, direct feed-through"
  extends Icons.Example;
  Networks.PolynomialNarx tested(n_u = 1, n_f = 1, n_y = 0, q = 3, n_k = 0, theta = {0.5, 0.3, 0.2, -0.1, 0.15, 0.05, -0.02, 0.04, 0.03, 0.01}, Ts = 0.01) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.u = sin(7*time);
  tested.f = 0.5*cos(5*time);
  annotation (experiment(StopTime = 1.1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Polynomial network of degree 3 without lagged outputs, direct feed-through. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Networks.PolynomialNarx\">Networks.PolynomialNarx</a>.</p>
</html>"));
end PolynomialNfir;
