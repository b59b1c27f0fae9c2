within HystFMU.Actuators.BaseClasses;
partial model Piezo "Piezoelectric actuator between two pins and two flanges, with a slot for any identified static model"
  extends Icons.Component;
  parameter Types.Voltage v_max(min = 0) = 100 "Range of voltage" annotation (Dialog(group = "Data sheet"));
  parameter Types.Position stroke(min = 0) = 26e-6 "Free stroke over this range" annotation (Dialog(group = "Data sheet"));
  parameter Types.Capacitance C(min = 0) = 6e-6 "Capacitance without load, mean over this range" annotation (Dialog(group = "Data sheet"));
  parameter Types.Stiffness k(min = 0) = 4e7 "Stiffness at constant polarisation, greater than 0" annotation (Dialog(group = "Data sheet"));
  parameter Types.Mass m(min = 0) = 0.02 "Moving mass at flange_b, greater than 0" annotation (Dialog(group = "Data sheet"));
  parameter Boolean withMass = true "Is there a mass at flange_b? false if another mass is joined rigidly" annotation (Dialog(group = "Data sheet"));
  parameter Types.Damping c(min = 0) = 20 "Damping between the flanges, greater than 0" annotation (Dialog(group = "Data sheet"));
  parameter Types.Stiffness k_pre(min = 0) = 0 "Stiffness of the spring that preloads it" annotation (Dialog(group = "Preload"));
  parameter Types.Force F_pre(min = 0) = 0 "Preload of an element without voltage; 0: no warning of tension" annotation (Dialog(group = "Preload"));
  parameter Integer n_series(min = 1) = 1 "Elements one on the other: their strokes add" annotation (Dialog(group = "Arrangement"));
  parameter Integer n_parallel(min = 1) = 1 "Elements side by side: their forces add" annotation (Dialog(group = "Arrangement"));
  parameter Types.Start start = Types.Start.rest "At v_start without load, or in equilibrium with what is connected" annotation (Dialog(group = "Start"));
  parameter Types.Voltage v_start = 0 "Voltage at the start; where the memory begins" annotation (Dialog(group = "Start"));
  parameter Real share(min = 0, max = 1) = 0.9 "Part of C that the moving polarisation has, between 0 and 1" annotation (Dialog(tab = "Advanced"));
  parameter Types.Resistance resistance(min = 0) = 1 "Resistance of the leads, greater than 0: a source of voltage needs no start value" annotation (Dialog(tab = "Advanced"));
  parameter Types.Time tau(min = 0) = 1e-5 "Relaxation of the polarisation, greater than 0" annotation (Dialog(tab = "Advanced"));
  parameter Boolean useHeatPort = false "Is there a port for the loss? Its sign may change within a cycle, see Heat" annotation (Dialog(tab = "Advanced"));
  parameter Types.Temperature T_fixed(min = 0) = 293.15 "Temperature without a port for the heat" annotation (Dialog(tab = "Advanced"));
  Interfaces.Pin pin_p "Positive pin" annotation (Placement(transformation(extent = {{-120, 40}, {-100, 60}})));
  Interfaces.Pin pin_n "Negative pin" annotation (Placement(transformation(extent = {{-120, -60}, {-100, -40}})));
  Interfaces.Flange flange_a "End that is mostly fixed" annotation (Placement(transformation(extent = {{-10, -120}, {10, -100}})));
  Interfaces.Flange flange_b "End that moves" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  Interfaces.HeatPort heatPort(T = T, Q_flow = -loss) if useHeatPort "Where loss goes: at least 0 at every instant if hysteresis.instantaneous, over closed cycles if hysteresis.passive" annotation (Placement(transformation(extent = {{-70, -120}, {-50, -100}})));
  // the values stand twice: those of the default are none of what is put in its place, and rumoca 0.10.2 does not apply
  // those of the constraining class to the default
  replaceable Actuators.Hysteresis.PrandtlIshlinskii hysteresis(u_start = v_start, gain = 1/v_max, scale = stroke/1.025)
    constrainedby BaseClasses.Hysteresis(u_start = v_start, gain = 1/v_max, scale = stroke/1.025) "From voltage to free stroke of an element" annotation (choicesAllMatching = true, Placement(transformation(extent = {{-40, -10}, {-20, 10}})));
  Elastic elastic(k = k, c = c, k_pre = k_pre, stroke_start = hysteresis.y_start, n_series = n_series, n_parallel = n_parallel) "Ceramic and preload" annotation (Placement(transformation(extent = {{10, -10}, {30, 10}})));
  Inertia inertia(m = m, start = start) if withMass "Moving mass" annotation (Placement(transformation(extent = {{60, 30}, {80, 50}})));
  Types.Temperature T(nominal = 300) "Temperature";
  Types.Voltage v(nominal = 100) "Voltage behind the leads";
  Types.Voltage e(nominal = 100) "Voltage that the polarisation follows";
  Types.Voltage driving(nominal = 100) "v, and what the tension adds to it";
  Types.Charge P(nominal = 1e-4) "Charge of the polarisation of an element";
  Types.Charge q(nominal = 1e-4) "Charge of an element";
  Types.Power loss "Power that becomes heat: at least 0 at every instant if hysteresis.instantaneous, over closed cycles if hysteresis.passive";
  Types.Energy dissipated(start = 0, fixed = true, nominal = 1e-3) "Heat since the start; falling over closed cycles: the hysteresis is not passive";
  Types.Energy supplied(start = 0, fixed = true, nominal = 1e-3) "Electrical and mechanical work since the start";
  Types.Energy stored(nominal = 1e-3) "Energy in capacitance, spring and memory; the mass has its own";
  Types.Energy residual(nominal = 1e-3) "Supplied less stored and dissipated; its change is the error of the balance";
protected
  parameter Real d(unit = "m/C") = stroke/(share*C*v_max) "Stroke of a charge, and voltage of a force";
  parameter Integer n_all = n_series*n_parallel "Number of elements";
  Types.Current dP "Rate of P";
  Real rate(unit = "V/s") "Rate of e";
initial equation
  if start == Types.Start.steady then
    der(q) = 0;
    e = driving;
  else
    q = hysteresis.y_rest/d + (1 - share)*C*v_start;
    e = v_start;
  end if;
equation
  assert(hysteresis.passive, "The passivity of this hysteresis is not shown: a closed cycle may give energy back, see dissipated and residual", AssertionLevel.warning);
  assert(F_pre <= 0 or elastic.F <= F_pre, "The tension exceeds the preload F_pre", AssertionLevel.warning);
  if not useHeatPort then
    T = T_fixed;
  end if;
  pin_p.i + pin_n.i = 0;
  pin_p.v - pin_n.v = v + resistance*pin_p.i;
  n_all*der(q) = pin_p.i;
  q = P + (1 - share)*C*v;
  P = hysteresis.y/d;
  dP = hysteresis.dy/d;
  driving = v + d*elastic.F;
  rate = (driving - e)/tau;
  der(e) = rate;
  hysteresis.u = e;
  hysteresis.du = rate;
  hysteresis.temperature = T;
  connect(hysteresis.y, elastic.stroke) annotation (Line(points = {{-19, 0}, {0, 0}, {0, 20}, {20, 20}, {20, 11}}, color = {0, 0, 127}));
  connect(elastic.flange_a, flange_a) annotation (Line(points = {{9, 0}, {0, 0}, {0, -110}}, color = {0, 127, 0}));
  connect(elastic.flange_b, flange_b) annotation (Line(points = {{31, 0}, {110, 0}}, color = {0, 127, 0}));
  connect(elastic.rest, inertia.rest) annotation (Line(points = {{31, 6}, {40, 6}, {40, 46}, {59, 46}}, color = {0, 0, 127}));
  connect(inertia.flange, flange_b) annotation (Line(points = {{59, 40}, {50, 40}, {50, 0}, {110, 0}}, color = {0, 127, 0}));
  loss = resistance*pin_p.i^2 + c*elastic.v_rel^2 + n_all*((driving - e)*dP + hysteresis.heat/d);
  der(dissipated) = loss;
  der(supplied) = (pin_p.v - pin_n.v)*pin_p.i + elastic.flange_b.f*elastic.v_rel;
  stored = n_all*(0.5*(1 - share)*C*v^2 + hysteresis.stored/d) + elastic.stored;
  residual = supplied - stored - dissipated;
  annotation (
    Icon(graphics = {Line(points = {{-40, -60}, {-40, 60}}, color = {64, 64, 64}), Line(points = {{0, -60}, {0, 60}}, color = {64, 64, 64}), Line(points = {{40, -60}, {40, 60}}, color = {64, 64, 64}), Line(points = {{-100, 50}, {-80, 50}}, color = {0, 0, 255}), Line(points = {{-100, -50}, {-80, -50}}, color = {0, 0, 255}), Line(points = {{80, 0}, {100, 0}}, color = {0, 127, 0})}),
    Documentation(info = "<html>
<p><b>Equation:</b> of an element, with F the tension: driving = v + d F, tau e' = driving - e, P = H[e]/d, q = P + (1 - share) C v, x = d P + F/k. H gives the free stroke; d = stroke/(share C v_max).</p>
<p><b>Power:</b> v q' + F x' = stored' + loss; loss = R i<sup>2</sup> + c x'<sup>2</sup> + (driving - e) P' + heat of H. Over a closed cycle the last two are the loop of driving over P, whatever the load. Elements are electrically in parallel.</p>
<p><b>Heat:</b> leads and damping lose at every instant. The hysteresis does so where the energy in its memory is known, <code>hysteresis.instantaneous</code>; where that is not known, loss holds over closed cycles, <code>hysteresis.passive</code>, and has either sign within one: a heat capacity at the port takes the mean, a sensor of heat flow shows the swing. Without either the actuator warns.</p>
<p><b>Source:</b> IEEE Std 176-1987, equations of a stack, with the polarisation of an identified model in the place of the linear one; structure of Goldfarb &amp; Celanovic, IEEE Control Systems 17 (1997) 69-79, which is share = 1.</p>
<p><b>Temperature:</b> that of the heat port, else T_fixed, reaches the hysteresis; a class that extends BaseClasses.Bent may follow it. The heat of a change of temperature is not in loss.</p>
<p><b>Limitations:</b> one polarisation; one lumped mass; C is the mean over the range, which exceeds the small-signal value of a data sheet, see Actuators.DataSheet; passive if H is, else a warning.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.StackMovesMass\">Examples.StackMovesMass</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.Stack\">Actuators.Stack</a>, <a href=\"modelica://HystFMU.Actuators.Bender\">Actuators.Bender</a>, <a href=\"modelica://HystFMU.Actuators.BaseClasses.Hysteresis\">Actuators.BaseClasses.Hysteresis</a>.</p>
</html>"));
end Piezo;
