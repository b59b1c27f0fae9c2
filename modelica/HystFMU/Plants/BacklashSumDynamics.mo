within HystFMU.Plants;
block BacklashSumDynamics "Hysteretic actuator: sum of backlash operators before second-order dynamics G0(s)"
  extends Icons.Block;
  extends Interfaces.Sampled;
  parameter Integer n(min = 1) = 10 "Number of backlash operators";
  parameter Real w0 = 0.3 "Weight of the linear term";
  parameter Real r[n](each min = 0) = linspace(0.05, 0.5, n) "Half-widths of the plays";
  parameter Real w[n] = fill(0.1, n) "Weights of the plays";
  parameter Real gain = 1 "Gain of G0";
  parameter Types.Frequency f_n(min = 0) = 500 "Natural frequency of G0";
  parameter Real zeta(min = 0) = 0.7 "Damping ratio of G0";
  Interfaces.RealInput u "Input of the actuator" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y "Displacement" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  Operators.Sampled.BacklashSum hysteresis(n = n, w0 = w0, r = r, w = w, Ts = Ts);
  Dynamics.TransferFunction dynamics(na = 2, b = {gain}, a = {1/omega_n^2, 2*zeta/omega_n, 1});
protected
  parameter Real omega_n(unit = "rad/s") = 6.283185307179586*f_n "Natural angular frequency";
equation
  connect(u, hysteresis.u);
  connect(hysteresis.y, dynamics.u);
  connect(dynamics.y, y);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = G0(s) (w0 u + sum_i w_i p_{r_i}[u]), G0(s) = gain/(s<sup>2</sup>/omega_n<sup>2</sup> + 2 zeta s/omega_n + 1).</p>
<p><b>Source:</b> Yu &amp; Alici 2005 (H followed by G0); Zhao &amp; Tan 2008, section II (ten backlash operators).</p>
<p><b>Limitations:</b> the hysteresis is sampled, its output is held for Ts; the dynamics are continuous.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.SlidingMode\">Examples.SlidingMode</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.BacklashSum\">Operators.Sampled.BacklashSum</a>, <a href=\"modelica://HystFMU.Dynamics.TransferFunction\">Dynamics.TransferFunction</a>.</p>
</html>"));
end BacklashSumDynamics;
