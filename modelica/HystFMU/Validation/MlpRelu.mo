// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model MlpRelu "Network with relu"
  extends Icons.Example;
  Networks.Mlp tested(n_in = 2, n_hidden = 3, n_out = 1, W1 = [0.5, -1.2; 2.1, 0.3; -0.7, 0.9], b1 = {0.1, -0.2, 0.3}, W2 = [1.1, -0.4, 0.6], b2 = {0.05}, activation = Types.Activation.relu) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.u[1] = 2*sin(7*time);
  tested.u[2] = cos(11*time) - 0.3;
  annotation (experiment(StopTime = 1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Network with relu. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Networks.Mlp\">Networks.Mlp</a>.</p>
</html>"));
end MlpRelu;
