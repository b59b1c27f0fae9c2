within HystFMU.Loops;
block DuhemPlant "Duhem operator in series with dynamics G0(s)"
  extends Interfaces.Plant;
  parameter Real k = 0.6 "Slope of the linear term" annotation (Dialog(group = "Parameters"));
  parameter Real a(min = 0) = 0.5 "Slope of the state at 0" annotation (Dialog(group = "Parameters"));
  parameter Real b(min = 0) = 0.8 "Decay of the slope with the state" annotation (Dialog(group = "Parameters"));
  parameter Real c(min = 0) = 0.6 "Decay of the slope with the absolute value of the state" annotation (Dialog(group = "Parameters"));
  parameter Types.Frequency f_n(min = 0) = 500 "Natural frequency of G0" annotation (Dialog(group = "Parameters"));
  parameter Real zeta(min = 0) = 0.7 "Damping ratio of G0" annotation (Dialog(group = "Parameters"));
  parameter Types.Time Ts = 1e-4 "Sample period of the hysteresis" annotation (Dialog(group = "Sampling"));
  Operators.Sampled.Duhem hysteresis(k = k, a_rise = {a}, b_rise = {-b}, c_rise = {-c}, a_fall = {a}, b_fall = {b}, c_fall = {-c}, Ts = Ts) annotation (Placement(transformation(extent = {{-60, -10}, {-40, 10}})));
  Dynamics.TransferFunction dynamics(na = 2, b = {1}, a = {1/omega_n^2, 2*zeta/omega_n, 1}) annotation (Placement(transformation(extent = {{20, -10}, {40, 10}})));
protected
  parameter Real omega_n(unit = "rad/s") = 6.283185307179586*f_n "Natural angular frequency";
equation
  connect(u, hysteresis.u) annotation (Line(points = {{-110, 0}, {-61, 0}}, color = {0, 0, 127}));
  connect(hysteresis.y, dynamics.u) annotation (Line(points = {{-39, 0}, {19, 0}}, color = {0, 0, 127}));
  connect(dynamics.y, y) annotation (Line(points = {{41, 0}, {110, 0}}, color = {0, 0, 127}));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = G0(s) (k u + w), w' = a u' - b abs(u') w - c u' abs(w), a Duhem operator.</p>
<p><b>Source:</b> Oh &amp; Bernstein 2005 (operator); Yu &amp; Alici 2005 (H followed by G0).</p>
<p><b>Limitations:</b> the hysteresis is sampled and its output is held over Ts; the dynamics are continuous.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.Duhem\">Examples.Duhem</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.Duhem\">Operators.Sampled.Duhem</a>, <a href=\"modelica://HystFMU.Loops.LinearInverse\">Loops.LinearInverse</a>.</p>
</html>"));
end DuhemPlant;
