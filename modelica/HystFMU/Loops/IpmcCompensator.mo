within HystFMU.Loops;
block IpmcCompensator "Network of lagged voltage and Zhao-Tan operator: displacement from the voltage of a sensor"
  extends Interfaces.Inverse;
  parameter Data.IpmcCompensatorOperator trained "Scaling and initial values of the training" annotation (Dialog(group = "Parameters"), Placement(transformation(extent = {{-80, 40}, {-60, 60}})));
  parameter Data.IpmcCompensatorNetwork weights "Trained network" annotation (Dialog(group = "Parameters"), Placement(transformation(extent = {{-40, 40}, {-20, 60}})));
  parameter Types.Time Ts = 1e-3 "Sample period" annotation (Dialog(group = "Sampling"));
  Affine scaled(gain = trained.input_gain[1], offset = trained.input_offset[1]) "Scaling to the range of the operator" annotation (Placement(transformation(extent = {{-90, -10}, {-70, 10}})));
  Operators.Sampled.ZhaoTan auxiliary(depth = trained.operator_depth, x0 = trained.operator_x0, Ts = Ts) "Auxiliary function" annotation (Placement(transformation(extent = {{-50, -30}, {-30, -10}})));
  Networks.PolynomialNarx basis(n_u = weights.network_n_u, n_f = weights.network_n_f, n_y = weights.network_n_y, n_k = weights.network_n_k, q = weights.network_q, theta = weights.network_theta, y0 = weights.network_y0, Ts = Ts) "Basis functions" annotation (Placement(transformation(extent = {{10, -10}, {30, 10}})));
  Affine readout(gain = weights.readout_gain[1], offset = weights.readout_offset[1]) annotation (Placement(transformation(extent = {{70, -10}, {90, 10}})));
equation
  connect(y, scaled.u) annotation (Line(points = {{-110, 0}, {-91, 0}}, color = {0, 0, 127}));
  connect(scaled.y, auxiliary.x) annotation (Line(points = {{-69, 0}, {-60, 0}, {-60, -20}, {-51, -20}}, color = {0, 0, 127}));
  connect(scaled.y, basis.u) annotation (Line(points = {{-69, 0}, {-30, 0}, {-30, 4}, {9, 4}}, color = {0, 0, 127}));
  connect(auxiliary.h, basis.f) annotation (Line(points = {{-29, -20}, {-10, -20}, {-10, -4}, {9, -4}}, color = {0, 0, 127}));
  connect(basis.y, readout.u) annotation (Line(points = {{31, 0}, {69, 0}}, color = {0, 0, 127}));
  connect(readout.y, u) annotation (Line(points = {{91, 0}, {110, 0}}, color = {0, 0, 127}));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> u = theta . phi(v, .., v<sub>-8</sub>, f, .., f<sub>-8</sub>), phi all monomials up to order 2, f = F[v] the operator of Zhao and Tan, v the scaled voltage.</p>
<p><b>Source:</b> IPMC hysteresis model with basis function network, eqs. 8 to 12; trained as in scenarios/papers/ipmc_bfbnn_compensator.</p>
<p><b>Limitations:</b> valid only for a sample period of 1 ms, and within the range of the training data, which is not checked.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.IpmcNetwork\">Examples.IpmcNetwork</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Networks.PolynomialNarx\">Networks.PolynomialNarx</a>, <a href=\"modelica://HystFMU.Operators.Sampled.ZhaoTan\">Operators.Sampled.ZhaoTan</a>, <a href=\"modelica://HystFMU.Loops.IpmcSensor\">Loops.IpmcSensor</a>.</p>
</html>"));
end IpmcCompensator;
