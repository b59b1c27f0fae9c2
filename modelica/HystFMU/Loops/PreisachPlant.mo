within HystFMU.Loops;
block PreisachPlant "Preisach operator in series with dynamics G0(s)"
  extends Interfaces.Plant;
  parameter Integer n(min = 1) = 4 "Number of grid steps over [lo, hi]" annotation (Dialog(group = "Sizes"));
  parameter Real lo = -2 "Input of negative saturation" annotation (Dialog(group = "Limits"));
  parameter Real hi = 2 "Input of positive saturation" annotation (Dialog(group = "Limits"));
  parameter Real E[div(n*(n + 1), 2)] = {0.65, 1.4, 0.65, 2.25, 1.4, 0.65, 3.2, 2.25, 1.4, 0.65} "Everett function" annotation (Dialog(group = "Parameters"));
  parameter Types.Frequency f_n(min = 0) = 500 "Natural frequency of G0" annotation (Dialog(group = "Parameters"));
  parameter Real zeta(min = 0) = 0.7 "Damping ratio of G0" annotation (Dialog(group = "Parameters"));
  parameter Types.Time Ts = 1e-4 "Sample period of the hysteresis" annotation (Dialog(group = "Sampling"));
  Operators.Sampled.Preisach hysteresis(n = n, lo = lo, hi = hi, E = E, Ts = Ts) annotation (Placement(transformation(extent = {{-60, -10}, {-40, 10}})));
  Dynamics.TransferFunction dynamics(na = 2, b = {1}, a = {1/omega_n^2, 2*zeta/omega_n, 1}) annotation (Placement(transformation(extent = {{20, -10}, {40, 10}})));
protected
  parameter Real omega_n(unit = "rad/s") = 6.283185307179586*f_n "Natural angular frequency";
equation
  connect(u, hysteresis.u) annotation (Line(points = {{-110, 0}, {-61, 0}}, color = {0, 0, 127}));
  connect(hysteresis.y, dynamics.u) annotation (Line(points = {{-39, 0}, {19, 0}}, color = {0, 0, 127}));
  connect(dynamics.y, y) annotation (Line(points = {{41, 0}, {110, 0}}, color = {0, 0, 127}));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = G0(s) H[u], with H as in Operators.BaseClasses.Preisach, initially demagnetised. The default is E = 0.6 (alpha - beta) + 0.05 (alpha - beta)<sup>2</sup> at the nodes.</p>
<p><b>Source:</b> Yu &amp; Alici 2005 (H followed by G0); Mayergoyz 1991 (H).</p>
<p><b>Limitations:</b> the hysteresis is sampled and its output is held over Ts; the dynamics are continuous.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.Preisach\">Examples.Preisach</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.Preisach\">Operators.Sampled.Preisach</a>, <a href=\"modelica://HystFMU.Loops.PreisachInverse\">Loops.PreisachInverse</a>.</p>
</html>"));
end PreisachPlant;
