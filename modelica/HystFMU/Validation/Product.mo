// generated from tests/vectors/derived/product.toml by `make generate` - do not edit
within HystFMU.Validation;
model Product "Product of signals, divided by a product of other signals, values of its first vector"
  extends Icons.Example;
  Dynamics.Product tested(n = 2, m = 1, least = 0.5) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.u[1] = 4*sin(7*time);
  tested.u[2] = 4*sin(5*time);
  tested.u[3] = 4*sin(11*time);
  annotation (experiment(StopTime = 1.1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Product of signals, divided by a product of other signals, values of its first vector. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.Product\">Dynamics.Product</a>.</p>
</html>"));
end Product;
