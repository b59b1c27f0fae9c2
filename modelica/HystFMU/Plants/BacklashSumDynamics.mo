within HystFMU.Plants;
block BacklashSumDynamics "Hysteretic actuator: sum of backlash operators in series with second-order dynamics G0(s)"
  extends Interfaces.Plant;
  extends Interfaces.Sampled;
  parameter Integer n(min = 1) = 10 "Number of backlash operators" annotation (Dialog(group = "Parameters"));
  parameter Real w0 = 0.3 "Weight of the linear term" annotation (Dialog(group = "Parameters"));
  parameter Real r[n](each min = 0) = linspace(0.05, 0.5, n) "Half-widths of the plays" annotation (Dialog(group = "Parameters"));
  parameter Real w[n] = fill(0.1, n) "Weights of the plays" annotation (Dialog(group = "Parameters"));
  parameter Real gain = 1 "Gain of G0" annotation (Dialog(group = "Parameters"));
  parameter Types.Frequency f_n(min = 0) = 500 "Natural frequency of G0" annotation (Dialog(group = "Parameters"));
  parameter Real zeta(min = 0) = 0.7 "Damping ratio of G0" annotation (Dialog(group = "Parameters"));
  Operators.Sampled.BacklashSum hysteresis(n = n, w0 = w0, r = r, w = w, Ts = Ts) annotation (Placement(transformation(extent = {{-60, -10}, {-40, 10}})));
  Dynamics.TransferFunction dynamics(na = 2, b = {gain}, a = {1/omega_n^2, 2*zeta/omega_n, 1}) annotation (Placement(transformation(extent = {{20, -10}, {40, 10}})));
protected
  parameter Real omega_n(unit = "rad/s") = 6.283185307179586*f_n "Natural angular frequency";
equation
  connect(u, hysteresis.u) annotation (Line(points = {{-110, 0}, {-61, 0}}, color = {0, 0, 127}));
  connect(hysteresis.y, dynamics.u) annotation (Line(points = {{-39, 0}, {19, 0}}, color = {0, 0, 127}));
  connect(dynamics.y, y) annotation (Line(points = {{41, 0}, {110, 0}}, color = {0, 0, 127}));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = G0(s) (w0 u + sum_i w_i p_{r_i}[u]), G0(s) = gain/(s<sup>2</sup>/omega_n<sup>2</sup> + 2 zeta s/omega_n + 1).</p>
<p><b>Source:</b> Yu &amp; Alici 2005 (H followed by G0); Zhao &amp; Tan 2008, section II (ten backlash operators).</p>
<p><b>Limitations:</b> the hysteresis is sampled and its output is held over Ts; the dynamics are continuous.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.SlidingMode\">Examples.SlidingMode</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.BacklashSum\">Operators.Sampled.BacklashSum</a>, <a href=\"modelica://HystFMU.Dynamics.TransferFunction\">Dynamics.TransferFunction</a>.</p>
</html>"));
end BacklashSumDynamics;
