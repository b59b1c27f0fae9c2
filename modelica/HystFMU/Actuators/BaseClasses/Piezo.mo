within HystFMU.Actuators.BaseClasses;
partial model Piezo "Piezoelectric actuator with pins and flanges, and a replaceable identified hysteresis"
  extends Icons.Component;
  parameter Types.Voltage v_max(min = 0) = 100 "Range of voltage" annotation (Dialog(group = "Data sheet"));
  parameter Types.Position stroke(min = 0) = 26e-6 "Free stroke over this range" annotation (Dialog(group = "Data sheet"));
  parameter Types.Capacitance C(min = 0) = 6e-6 "Capacitance without load, mean over this range" annotation (Dialog(group = "Data sheet"));
  parameter Types.Stiffness k(min = 0) = 4e7 "Stiffness at constant polarisation, greater than 0" annotation (Dialog(group = "Data sheet"));
  parameter Types.Mass m(min = 0) = 0.02 "Moving mass at flange_b, greater than 0" annotation (Dialog(group = "Data sheet"));
  parameter Boolean withMass = true "True if the actuator has a mass; false if a rigid load has the mass" annotation (Dialog(group = "Data sheet"));
  parameter Types.Damping c(min = 0) = 20 "Damping between the flanges, greater than 0" annotation (Dialog(group = "Data sheet"));
  parameter Types.Stiffness k_pre(min = 0) = 0 "Stiffness of the preload spring" annotation (Dialog(group = "Preload"));
  parameter Types.Force F_pre(min = 0) = 0 "Preload of an element without voltage; 0: no warning of tension" annotation (Dialog(group = "Preload"));
  parameter Integer n_series(min = 1) = 1 "Number of elements in series" annotation (Dialog(group = "Arrangement"));
  parameter Integer n_parallel(min = 1) = 1 "Number of elements in parallel" annotation (Dialog(group = "Arrangement"));
  parameter Types.Start start = Types.Start.rest "Initial state: at v_start without load, or in equilibrium" annotation (Dialog(group = "Start"));
  parameter Types.Voltage v_start = 0 "Initial voltage, also of the memory" annotation (Dialog(group = "Start"));
  parameter Real share(min = 0, max = 1) = 0.9 "Share of C that is due to the hysteresis, between 0 and 1" annotation (Dialog(tab = "Advanced"));
  parameter Types.Resistance resistance(min = 0) = 1 "Resistance of the leads, greater than 0" annotation (Dialog(tab = "Advanced"));
  parameter Types.Time tau(min = 0) = 1e-5 "Time constant of the polarisation, greater than 0" annotation (Dialog(tab = "Advanced"));
  parameter Boolean useHeatPort = false "True if the actuator has a heat port, see Heat" annotation (Dialog(tab = "Advanced"));
  parameter Types.Temperature T_fixed(min = 0) = 293.15 "Temperature without heat port" annotation (Dialog(tab = "Advanced"));
  Interfaces.Pin pin_p "Positive pin" annotation (Placement(transformation(extent = {{-120, 40}, {-100, 60}})));
  Interfaces.Pin pin_n "Negative pin" annotation (Placement(transformation(extent = {{-120, -60}, {-100, -40}})));
  Interfaces.Flange flange_a "Fixed end" annotation (Placement(transformation(extent = {{-10, -120}, {10, -100}})));
  Interfaces.Flange flange_b "Moving end" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  Interfaces.HeatPort heatPort(T = T, Q_flow = -loss) if useHeatPort "Heat port for the variable loss" annotation (Placement(transformation(extent = {{-70, -120}, {-50, -100}})));
  // both clauses need the values: a replacement does not get those of the default, and rumoca 0.10.2 does not apply
  // those of the constraining class to the default
  replaceable Actuators.Hysteresis.PrandtlIshlinskii hysteresis(u_start = v_start, gain = 1/v_max, scale = stroke/1.025)
    constrainedby BaseClasses.Hysteresis(u_start = v_start, gain = 1/v_max, scale = stroke/1.025) "Hysteresis from voltage to free stroke of an element" annotation (choicesAllMatching = true, Placement(transformation(extent = {{-40, -10}, {-20, 10}})));
  Elastic elastic(k = k, c = c, k_pre = k_pre, stroke_start = hysteresis.y_start, n_series = n_series, n_parallel = n_parallel) "Ceramic and preload" annotation (Placement(transformation(extent = {{10, -10}, {30, 10}})));
  Inertia inertia(m = m, start = start) if withMass "Moving mass" annotation (Placement(transformation(extent = {{60, 30}, {80, 50}})));
  Types.Temperature T(nominal = 300) "Temperature";
  Types.Voltage v(nominal = 100) "Voltage behind the leads";
  Types.Voltage e(nominal = 100) "Voltage that determines the polarisation";
  Types.Voltage driving(nominal = 100) "v plus the voltage due to the tension";
  Types.Charge P(nominal = 1e-4) "Charge of the polarisation of an element";
  Types.Charge q(nominal = 1e-4) "Charge of an element";
  Types.Power loss "Heating power; for its sign see Heat";
  Types.Energy dissipated(start = 0, fixed = true, nominal = 1e-3) "Heat since the start; decreases over closed cycles if the hysteresis is not passive";
  Types.Energy supplied(start = 0, fixed = true, nominal = 1e-3) "Electrical and mechanical work since the start";
  Types.Energy stored(nominal = 1e-3) "Energy in capacitance, spring and memory, without the mass";
  Types.Energy residual(nominal = 1e-3) "supplied - stored - dissipated; its change is the error of the energy balance";
protected
  parameter Real d(unit = "m/C") = stroke/(share*C*v_max) "Stroke per charge, equal to voltage per force";
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
  assert(hysteresis.passive, "The passivity of this hysteresis is not proven: a closed cycle may generate energy, see the variables dissipated and residual", AssertionLevel.warning);
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
<p><b>Equation:</b> for an element with tension F: driving = v + d F, tau e' = driving - e, P = H[e]/d, q = P + (1 - share) C v, x = d P + F/k. H gives the free stroke; d = stroke/(share C v_max).</p>
<p><b>Power:</b> v q' + F x' = stored' + loss; loss = R i<sup>2</sup> + c x'<sup>2</sup> + (driving - e) P' + heat of H. Over a closed cycle, the sum of the last two terms is the area of the loop of driving over P for any load. The elements are electrically in parallel.</p>
<p><b>Heat:</b> the loss of leads and damping is &ge; 0 at every instant. The loss of the hysteresis is &ge; 0 at every instant if <code>hysteresis.instantaneous</code> is true, that is, if the energy in the memory is known. If only <code>hysteresis.passive</code> is true, its mean over each closed cycle is &ge; 0, and its sign changes within a cycle. A heat capacity at the port averages this loss; a heat flow sensor shows the changes of sign. If both are false, the actuator warns.</p>
<p><b>Source:</b> IEEE Std 176-1987, equations of a stack, with the polarisation of an identified model in the place of the linear one; structure of Goldfarb &amp; Celanovic, IEEE Control Systems 17 (1997) 69-79, which is share = 1.</p>
<p><b>Temperature:</b> the hysteresis gets the temperature of the heat port, or T_fixed without heat port. Classes that extend BaseClasses.Bent may depend on this temperature. The heat due to a change of temperature is not part of loss.</p>
<p><b>Limitations:</b> one polarisation; one lumped mass. C is the mean over the range, which is larger than the small-signal value of a data sheet (see Actuators.DataSheet). The actuator is passive if H is passive; otherwise it warns.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.StackMovesMass\">Examples.StackMovesMass</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.Stack\">Actuators.Stack</a>, <a href=\"modelica://HystFMU.Actuators.Bender\">Actuators.Bender</a>, <a href=\"modelica://HystFMU.Actuators.BaseClasses.Hysteresis\">Actuators.BaseClasses.Hysteresis</a>.</p>
</html>"));
end Piezo;
