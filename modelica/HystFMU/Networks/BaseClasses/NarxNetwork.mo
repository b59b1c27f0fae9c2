// generated from the table of fmu_build/core/blocks/networks/narx_network.c by `make generate` - do not edit
within HystFMU.Networks.BaseClasses;
partial block NarxNetwork "NARX network: one hidden layer with lags of input and output: parameters and ports"
  extends Icons.Block;
  parameter Integer n_u(min = 1) = 2 "Number of inputs u_k to u_(k-n_u+1)" annotation (Dialog(group = "Sizes"));
  parameter Integer n_y(min = 0) = 1 "Number of outputs y_(k-1) to y_(k-n_y)" annotation (Dialog(group = "Sizes"));
  parameter Integer n_hidden(min = 1) = 4 "Number of hidden neurons" annotation (Dialog(group = "Sizes"));
  parameter Real a[n_u + n_y] = fill(0.1, n_u + n_y) "Linear weights of the inputs, then of the outputs" annotation (Dialog(group = "Weights"));
  parameter Real W1[n_hidden*(n_u + n_y)] = fill(0.2, n_hidden*(n_u + n_y)) "Hidden weights, one row per neuron" annotation (Dialog(group = "Weights"));
  parameter Real b1[n_hidden] = fill(0.0, n_hidden) "Hidden biases" annotation (Dialog(group = "Weights"));
  parameter Real W2[n_hidden] = fill(0.1, n_hidden) "Output weights" annotation (Dialog(group = "Weights"));
  parameter Real b2 = 0 "Output bias" annotation (Dialog(group = "Weights"));
  parameter Real y0 = 0 "Output before the first input" annotation (Dialog(group = "Start"));
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y "Output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y_k = a'z + W2 tanh(W1 z + b1) + b2, z = u_k .. u_(k-n_u+1), y_(k-1) .. y_(k-n_y).</p>
<p><b>Source:</b> Narendra &amp; Parthasarathy 1990; Leontaritis &amp; Billings 1985 (NARX).</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.NarxNetwork\">Validation.NarxNetwork</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Networks.NarxNetwork\">Networks.NarxNetwork</a>.</p>
</html>"));
end NarxNetwork;
