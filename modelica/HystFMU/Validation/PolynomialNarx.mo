// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model PolynomialNarx "Polynomial network of degree 2 in four variables"
  extends Icons.Example;
  Networks.PolynomialNarx tested(n_u = 2, n_f = 1, n_y = 1, q = 2, theta = {0.3, -0.2, 0.25, 0.1, 0.4, 0.05, -0.1, 0.02, 0.03, -0.04, 0.06, 0.01, -0.02, 0.05, 0.02}, y0 = 0.1, Ts = 0.01) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.u = sin(7*time);
  tested.f = 0.5*cos(5*time);
  annotation (experiment(StopTime = 1.1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Polynomial network of degree 2 in four variables. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Networks.PolynomialNarx\">Networks.PolynomialNarx</a>.</p>
</html>"));
end PolynomialNarx;
