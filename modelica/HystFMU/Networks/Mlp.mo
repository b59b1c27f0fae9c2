within HystFMU.Networks;
block Mlp "Multilayer perceptron: one hidden layer, linear outputs"
  extends Icons.Block;
  parameter Integer n_in(min = 1) = 1 "Number of inputs";
  parameter Integer n_hidden(min = 1) = 12 "Number of hidden neurons";
  parameter Integer n_out(min = 1) = 1 "Number of outputs";
  parameter Real W1[n_hidden, n_in] = ones(n_hidden, n_in) "Hidden weights, one row per hidden neuron";
  parameter Real b1[n_hidden] = zeros(n_hidden) "Hidden biases";
  parameter Real W2[n_out, n_hidden] = ones(n_out, n_hidden) "Output weights, one row per output";
  parameter Real b2[n_out] = zeros(n_out) "Output biases";
  parameter Types.Activation activation = Types.Activation.sigmoid "Activation of the hidden neurons";
  Interfaces.RealInput u[n_in] "Inputs" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y[n_out] "Outputs" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
equation
  y = b2 + W2*Functions.activation(b1 + W1*u, activation);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = b2 + W2 f(b1 + W1 u), f the activation.</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, section IV; Shen &amp; Ma 2017.</p>
<p><b>Limitations:</b> memoryless; far outside the range of its training a network means nothing.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Mlp\">Validation.Mlp</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Networks.PolynomialNarx\">Networks.PolynomialNarx</a>, <a href=\"modelica://HystFMU.Operators.Sampled.PlayBank\">Operators.Sampled.PlayBank</a>.</p>
</html>"));
end Mlp;
