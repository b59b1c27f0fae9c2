within HystFMU.Loops;
block BoucWenPlant "Linear term and Bouc-Wen state, in series with dynamics G0(s)"
  extends Interfaces.Plant;
  parameter Real A = 1 "Initial slope of z" annotation (Dialog(group = "Parameters"));
  parameter Real beta = 1 "Dissipation" annotation (Dialog(group = "Parameters"));
  parameter Real gamma = -0.2 "Shape" annotation (Dialog(group = "Parameters"));
  parameter Real k[2] = {1.65, -0.77} "Weights of input and z" annotation (Dialog(group = "Parameters"));
  parameter Types.Frequency f_n(min = 0) = 500 "Natural frequency of G0" annotation (Dialog(group = "Parameters"));
  parameter Real zeta(min = 0) = 0.7 "Damping ratio of G0" annotation (Dialog(group = "Parameters"));
  parameter Types.Time Ts = 1e-4 "Sample period of the hysteresis" annotation (Dialog(group = "Sampling"));
  Operators.Sampled.BoucWen hysteresis(A = A, beta = beta, gamma = gamma, Ts = Ts) annotation (Placement(transformation(extent = {{-60, -40}, {-40, -20}})));
  SumOfTwo readout(k1 = k[1], k2 = k[2]) annotation (Placement(transformation(extent = {{-10, -10}, {10, 10}})));
  Dynamics.TransferFunction dynamics(na = 2, b = {1}, a = {1/omega_n^2, 2*zeta/omega_n, 1}) annotation (Placement(transformation(extent = {{40, -10}, {60, 10}})));
protected
  parameter Real omega_n(unit = "rad/s") = 6.283185307179586*f_n "Natural angular frequency";
equation
  connect(u, hysteresis.u) annotation (Line(points = {{-110, 0}, {-85.5, 0}, {-85.5, -30}, {-61, -30}}, color = {0, 0, 127}));
  connect(u, readout.u1) annotation (Line(points = {{-110, 0}, {-60.5, 0}, {-60.5, 4}, {-11, 4}}, color = {0, 0, 127}));
  connect(hysteresis.z, readout.u2) annotation (Line(points = {{-39, -34}, {-25, -34}, {-25, -4}, {-11, -4}}, color = {0, 0, 127}));
  connect(readout.y, dynamics.u) annotation (Line(points = {{11, 0}, {39, 0}}, color = {0, 0, 127}));
  connect(dynamics.y, y) annotation (Line(points = {{61, 0}, {110, 0}}, color = {0, 0, 127}));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = G0(s) (k_1 u + k_2 z), z the state of a Bouc-Wen operator with n = 1.</p>
<p><b>Source:</b> Yu &amp; Alici 2005 (H followed by G0), with the hysteresis of Bouc and Wen as in the scenarios.</p>
<p><b>Limitations:</b> the hysteresis is sampled and its output is held over Ts; the dynamics are continuous.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.BoucWen\">Examples.BoucWen</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.BoucWen\">Operators.Sampled.BoucWen</a>, <a href=\"modelica://HystFMU.Plants.BacklashSumDynamics\">Plants.BacklashSumDynamics</a>.</p>
</html>"));
end BoucWenPlant;
