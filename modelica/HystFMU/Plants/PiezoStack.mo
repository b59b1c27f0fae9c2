within HystFMU.Plants;
model PiezoStack "Piezo stack between an electrical and a mechanical port, with hysteresis"
  extends Icons.Component;
  parameter Integer n(min = 1) = 10 "Number of plays";
  parameter Real w0 = 0.3 "Weight of the linear term";
  parameter Real r[n](each min = 0) = linspace(0.05, 0.5, n) "Half-widths of the plays, in parts of v_max";
  parameter Real w[n] = fill(0.1, n) "Weights of the plays";
  parameter Types.Voltage v_max(min = 0) = 100 "Voltage that the hysteresis is normalised with";
  parameter Types.Position stroke_max = 20e-6 "Free stroke where the operator gives 1";
  parameter Types.Capacitance C(min = 0) = 2e-6 "Capacitance";
  parameter Types.Stiffness k(min = 0) = 1e7 "Stiffness of the stack";
  Interfaces.Pin pin_p "Positive pin" annotation (Placement(transformation(extent = {{-120, 40}, {-100, 60}})));
  Interfaces.Pin pin_n "Negative pin" annotation (Placement(transformation(extent = {{-120, -60}, {-100, -40}})));
  Interfaces.Flange flange "Moving end; the other one is fixed" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  // the values stand twice, because rumoca 0.10.2 does not apply those of the constraining class to the default
  replaceable Operators.Smooth.PrandtlIshlinskii hysteresis(n = n, depth = 16, w0 = w0, r = r, w = w)
    constrainedby Operators.BaseClasses.PrandtlIshlinskii(n = n, depth = 16, w0 = w0, r = r, w = w)
    "From voltage to free stroke" annotation (Placement(transformation(extent = {{-10, -10}, {10, 10}})));
  Types.Voltage v(start = 0, fixed = true) "Voltage across the stack";
  Types.Position stroke "Free stroke";
protected
  Interfaces.RealOutput normalised "Voltage in parts of v_max";
  Interfaces.RealOutput rate(unit = "1/s") "Its rate: known from the current, nothing is differentiated";
equation
  v = pin_p.v - pin_n.v;
  C*der(v) = pin_p.i;
  pin_p.i + pin_n.i = 0;
  normalised = v/v_max;
  rate = pin_p.i/(C*v_max);
  connect(normalised, hysteresis.u);
  connect(rate, hysteresis.du);
  stroke = stroke_max*hysteresis.y;
  flange.f = k*(flange.s - stroke);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> C v' = i, stroke = stroke_max H[v/v_max], f = k (s - stroke).</p>
<p><b>Source:</b> Goldfarb &amp; Celanovic, IEEE Control Systems 17 (1997) 69-79, without the charge of the direct effect; hysteresis: Krejci &amp; Kuhnen 2001.</p>
<p><b>Limitations:</b> the force does not act back on the charge.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.PiezoStack\">Examples.PiezoStack</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Smooth.PrandtlIshlinskii\">Operators.Smooth.PrandtlIshlinskii</a>, <a href=\"modelica://HystFMU.Plants.VoltageDrive\">Plants.VoltageDrive</a>, <a href=\"modelica://HystFMU.Plants.SpringMassLoad\">Plants.SpringMassLoad</a>.</p>
</html>"));
end PiezoStack;
