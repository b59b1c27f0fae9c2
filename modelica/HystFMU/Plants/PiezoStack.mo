within HystFMU.Plants;
model PiezoStack "Piezo stack between two pins and two flanges, with hysteresis of its polarisation; passive"
  extends Icons.Component;
  parameter Integer n(min = 1) = 10 "Number of plays" annotation (Dialog(group = "Hysteresis"));
  parameter Real w0 = 0.3 "Weight of the linear term" annotation (Dialog(group = "Hysteresis"));
  parameter Real r[n](each min = 0) = linspace(0.05, 0.5, n) "Half-widths of the plays, in parts of v_max" annotation (Dialog(group = "Hysteresis"));
  parameter Real w[n] = fill(0.1, n) "Weights of the plays, not negative" annotation (Dialog(group = "Hysteresis"));
  parameter Types.Voltage v_max(min = 0) = 100 "Voltage that the hysteresis is normalised with" annotation (Dialog(group = "Data sheet"));
  parameter Types.Position stroke_max = 20e-6 "Free stroke at v_max where the operator gives 1" annotation (Dialog(group = "Data sheet"));
  parameter Types.Capacitance C(min = 0) = 2e-6 "Capacitance without load" annotation (Dialog(group = "Data sheet"));
  parameter Types.Stiffness k(min = 0) = 1e7 "Stiffness at constant polarisation" annotation (Dialog(group = "Data sheet"));
  parameter Real share(min = 0, max = 1) = 0.5 "Part of C that the moving polarisation has, between 0 and 1" annotation (Dialog(tab = "Advanced"));
  parameter Types.Resistance resistance(min = 0) = 1 "Resistance of the leads, greater than 0: a source of voltage needs no start value" annotation (Dialog(tab = "Advanced"));
  parameter Types.Time tau(min = 0) = 1e-5 "Relaxation of the polarisation, greater than 0" annotation (Dialog(tab = "Advanced"));
  parameter Types.Voltage v_start = 0 "Voltage at the start, where the stack rests without load" annotation (Dialog(group = "Start"));
  parameter Types.Position length = 0 "Distance of the flanges at rest without polarisation" annotation (Dialog(group = "Start"));
  Interfaces.Pin pin_p "Positive pin" annotation (Placement(transformation(extent = {{-120, 40}, {-100, 60}})));
  Interfaces.Pin pin_n "Negative pin" annotation (Placement(transformation(extent = {{-120, -60}, {-100, -40}})));
  Interfaces.Flange flange_a "End that is mostly fixed" annotation (Placement(transformation(extent = {{-10, -120}, {10, -100}})));
  Interfaces.Flange flange_b "End that moves" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  // the values stand twice, because rumoca 0.10.2 does not apply those of the constraining class to the default
  replaceable Operators.Smooth.PrandtlIshlinskii hysteresis(n = n, depth = 16, w0 = w0, r = r, w = w, u0 = v_start/v_max)
    constrainedby Operators.BaseClasses.PrandtlIshlinskii(n = n, depth = 16, w0 = w0, r = r, w = w, u0 = v_start/v_max)
    "From voltage to polarisation" annotation (choicesAllMatching = true, Placement(transformation(extent = {{-10, -10}, {10, 10}})));
  Types.Voltage v "Voltage behind the leads";
  Types.Voltage e(nominal = v_max, start = v_start, fixed = true) "Voltage that the polarisation follows";
  Types.Force F "Tension";
  Types.Position stroke "Stroke of the polarisation";
  Real P(quantity = "ElectricCharge", unit = "C") "Charge of the polarisation that moves the stack";
  Real q(quantity = "ElectricCharge", unit = "C", nominal = 1e-4, start = share*C*(w0 + sum(w))*v_start + (1 - share)*C*v_start, fixed = true) "Charge";
  Types.Voltage driving "v, and what the tension adds to it";
protected
  parameter Real d(unit = "m/C") = stroke_max/(share*C*v_max) "Stroke of a charge, and voltage of a force";
  Interfaces.RealOutput normalised "e in parts of v_max" annotation (Placement(transformation(extent = {{-60, -10}, {-40, 10}})));
  Interfaces.RealOutput rate(unit = "1/s") "Its rate: nothing is differentiated" annotation (Placement(transformation(extent = {{-60, -40}, {-40, -20}})));
equation
  pin_p.i + pin_n.i = 0;
  pin_p.v - pin_n.v = v + resistance*pin_p.i;
  der(q) = pin_p.i;
  q = P + (1 - share)*C*v;
  P = share*C*v_max*hysteresis.y;
  stroke = d*P;
  F = k*(flange_b.s - flange_a.s - length - stroke);
  flange_b.f = F;
  flange_a.f = -F;
  driving = v + d*F;
  tau*der(e) = driving - e;
  normalised = e/v_max;
  rate = (driving - e)/(tau*v_max);
  connect(normalised, hysteresis.u) annotation (Line(points = {{-50, 0}, {-11, 0}}, color = {0, 0, 127}));
  connect(rate, hysteresis.du) annotation (Line(points = {{-50, -30}, {-30.5, -30}, {-30.5, -7}, {-11, -7}}, color = {0, 0, 127}));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> P = H[e], tau e' + e = v + d F, q = P + C v, x = d P + F/k: C and P have the parts 1 - share and share of the capacitance.</p>
<p><b>Power:</b> v q' + F x' = (C v<sup>2</sup>/2 + F<sup>2</sup>/(2 k))' + (v + d F) P'. The last term gives no energy back over a closed cycle if the weights are not negative: the model is passive. The sum of the losses is resistance i<sup>2</sup> + tau e' P' + v_max share C v_max sum_i w_i r_i abs(z_i').</p>
<p><b>Source:</b> IEEE Std 176-1987 with the polarisation of Krejci &amp; Kuhnen 2001 in the place of the linear one; structure of Goldfarb &amp; Celanovic, IEEE Control Systems 17 (1997) 69-79.</p>
<p><b>Limitations:</b> one polarisation; mass and damping are those of the parts at the flanges; the short-circuited stack is softer than k by d<sup>2</sup> times the slope of P.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.PiezoStack\">Examples.PiezoStack</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Smooth.PrandtlIshlinskii\">Operators.Smooth.PrandtlIshlinskii</a>, <a href=\"modelica://HystFMU.Plants.VoltageDrive\">Plants.VoltageDrive</a>, <a href=\"modelica://HystFMU.Plants.SpringMassLoad\">Plants.SpringMassLoad</a>, <a href=\"modelica://HystFMU.Plants.Fixed\">Plants.Fixed</a>.</p>
</html>"));
end PiezoStack;
