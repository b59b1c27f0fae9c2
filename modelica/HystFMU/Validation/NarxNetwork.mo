// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model NarxNetwork "NARX network of two neurons with two lags of the output"
  extends Icons.Example;
  Networks.NarxNetwork tested(n_u = 2, n_y = 2, n_hidden = 2, a = {0.4, -0.2, 0.5, -0.1}, W1 = {0.8, -0.3, 0.6, 0.2, -0.5, 0.7, 0.1, -0.4}, b1 = {0.1, -0.2}, W2 = {0.5, -0.6}, b2 = 0.05, y0 = 0.1, Ts = 0.01) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.u = sin(7*time);
  annotation (experiment(StopTime = 1.1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>NARX network of two neurons with two lags of the output. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Networks.NarxNetwork\">Networks.NarxNetwork</a>.</p>
</html>"));
end NarxNetwork;
