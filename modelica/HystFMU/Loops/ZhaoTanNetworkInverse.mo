within HystFMU.Loops;
block ZhaoTanNetworkInverse "Learned inverse of Zhao and Tan: network on the input and output of an inverse operator"
  extends Interfaces.Inverse;
  parameter Data.BacklashZhaoTanInverse identified "Trained network" annotation (Dialog(group = "Parameters"), Placement(transformation(extent = {{-80, 40}, {-60, 60}})));
  parameter Types.Time Ts = 1e-4 "Sample period" annotation (Dialog(group = "Sampling"));
  Affine scaled(gain = identified.input_gain[1], offset = identified.input_offset[1]) "Scaling to the range of the operator" annotation (Placement(transformation(extent = {{-90, -10}, {-70, 10}})));
  Inverse.Sampled.ZhaoTanInverse memory(depth = identified.operator_depth, x0 = identified.operator_x0, Ts = Ts) annotation (Placement(transformation(extent = {{-50, -30}, {-30, -10}})));
  NetworkOfTwo network(n_hidden = identified.network_n_hidden, gain = identified.features_gain, offset = identified.features_offset, lo = identified.features_lo, hi = identified.features_hi, W1 = identified.network_W1, b1 = identified.network_b1, W2 = identified.network_W2, b2 = identified.network_b2) annotation (Placement(transformation(extent = {{10, -10}, {30, 10}})));
  Affine readout(gain = identified.readout_gain[1], offset = identified.readout_offset[1]) annotation (Placement(transformation(extent = {{70, -10}, {90, 10}})));
equation
  connect(y, scaled.u) annotation (Line(points = {{-110, 0}, {-91, 0}}, color = {0, 0, 127}));
  connect(scaled.y, memory.h) annotation (Line(points = {{-69, 0}, {-60, 0}, {-60, -20}, {-51, -20}}, color = {0, 0, 127}));
  connect(scaled.y, network.u1) annotation (Line(points = {{-69, 0}, {-30, 0}, {-30, 4}, {9, 4}}, color = {0, 0, 127}));
  connect(memory.x, network.u2) annotation (Line(points = {{-29, -20}, {-10, -20}, {-10, -4}, {9, -4}}, color = {0, 0, 127}));
  connect(network.y, readout.u) annotation (Line(points = {{31, 0}, {69, 0}}, color = {0, 0, 127}));
  connect(readout.y, u) annotation (Line(points = {{91, 0}, {110, 0}}, color = {0, 0, 127}));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> u = N(y, Z[y]) with scaled y, the inverse Zhao-Tan operator Z and a network N of one hidden layer of twelve neurons.</p>
<p><b>Source:</b> Zhao &amp; Tan 2008: the network learns a one-to-one map, since the operator carries the memory.</p>
<p><b>Limitations:</b> valid only within the range of the training data.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.ZhaoTan\">Examples.ZhaoTan</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Sampled.ZhaoTanInverse\">Inverse.Sampled.ZhaoTanInverse</a>, <a href=\"modelica://HystFMU.Loops.NetworkOfTwo\">Loops.NetworkOfTwo</a>, <a href=\"modelica://HystFMU.Loops.Tracking\">Loops.Tracking</a>.</p>
</html>"));
end ZhaoTanNetworkInverse;
