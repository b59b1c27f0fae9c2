// generated from the table of fmu_build/core/blocks/networks/mlp.c by `make generate` - do not edit
within HystFMU.Networks.BaseClasses;
partial block Mlp "Multilayer perceptron: one hidden layer, linear outputs: parameters and ports"
  extends Icons.Block;
  parameter Integer n_in(min = 1) = 1 "Number of inputs" annotation (Dialog(group = "Sizes"));
  parameter Integer n_hidden(min = 1) = 12 "Number of hidden neurons" annotation (Dialog(group = "Sizes"));
  parameter Integer n_out(min = 1) = 1 "Number of outputs" annotation (Dialog(group = "Sizes"));
  parameter Real W1[n_hidden, n_in] = fill(1.0, n_hidden, n_in) "Hidden weights, one row per hidden neuron" annotation (Dialog(group = "Weights"));
  parameter Real b1[n_hidden] = fill(0.0, n_hidden) "Hidden biases" annotation (Dialog(group = "Weights"));
  parameter Real W2[n_out, n_hidden] = fill(1.0, n_out, n_hidden) "Output weights, one row per output" annotation (Dialog(group = "Weights"));
  parameter Real b2[n_out] = fill(0.0, n_out) "Output biases" annotation (Dialog(group = "Weights"));
  parameter Types.Activation activation = Types.Activation.sigmoid "Activation of the hidden neurons" annotation (Dialog(group = "Network"));
  Interfaces.RealInput u[n_in] "Inputs" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y[n_out] "Outputs" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = b2 + W2 f(b1 + W1 u), f the activation.</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, section IV.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Mlp\">Validation.Mlp</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Networks.Mlp\">Networks.Mlp</a>.</p>
</html>"));
end Mlp;
