within HystFMU.Loops;
block NetworkOfTwo "Network with one output and two inputs, which are limited and scaled"
  extends Icons.Block;
  parameter Integer n_hidden(min = 1) = 12 "Number of hidden neurons" annotation (Dialog(group = "Sizes"));
  parameter Real gain[2] = {1, 1} "Gains of the inputs" annotation (Dialog(group = "Scaling"));
  parameter Real offset[2] = {0, 0} "Offsets, added after the gains" annotation (Dialog(group = "Scaling"));
  parameter Real lo[2] = {-1e300, -1e300} "Lower limits of the inputs" annotation (Dialog(group = "Scaling"));
  parameter Real hi[2] = {1e300, 1e300} "Upper limits of the inputs" annotation (Dialog(group = "Scaling"));
  parameter Real W1[n_hidden, 2] = fill(1.0, n_hidden, 2) "Hidden weights" annotation (Dialog(group = "Weights"));
  parameter Real b1[n_hidden] = fill(0.0, n_hidden) "Hidden biases" annotation (Dialog(group = "Weights"));
  parameter Real W2[1, n_hidden] = fill(1.0, 1, n_hidden) "Output weights" annotation (Dialog(group = "Weights"));
  parameter Real b2[1] = {0} "Output bias" annotation (Dialog(group = "Weights"));
  Interfaces.RealInput u1 "First input" annotation (Placement(transformation(extent = {{-120, 30}, {-100, 50}})));
  Interfaces.RealInput u2 "Second input" annotation (Placement(transformation(extent = {{-120, -50}, {-100, -30}})));
  Interfaces.RealOutput y "Output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  Real first "First input, limited and scaled";
  Real second "Second input, limited and scaled";
equation
  first = min(hi[1], max(lo[1], u1))*gain[1] + offset[1];
  second = min(hi[2], max(lo[2], u2))*gain[2] + offset[2];
  y = b2[1] + sum(W2[1, j]/(1 + exp(-(b1[j] + W1[j, 1]*first + W1[j, 2]*second))) for j in 1:n_hidden);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = b2 + W2 s(b1 + W1 x), s(a) = 1/(1 + e<sup>-a</sup>), x the inputs limited and scaled.</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, fig. 4.</p>
<p><b>Limitations:</b> sigmoid only. Between sampled blocks, this block replaces Dynamics.Scaling and Networks.Mlp, whose vector outputs are one sample late in rumoca 0.10.2.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Loops.ZhaoTanNetworkInverse\">Loops.ZhaoTanNetworkInverse</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Networks.Mlp\">Networks.Mlp</a>, <a href=\"modelica://HystFMU.Dynamics.Scaling\">Dynamics.Scaling</a>.</p>
</html>"));
end NetworkOfTwo;
