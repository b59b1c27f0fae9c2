within HystFMU.Actuators.BaseClasses;
partial model Magnetostrictive "Current-driven actuator between two pins and two flanges, with a slot for any identified static model"
  extends Icons.Component;
  parameter Real i_max(unit = "A", min = 0) = 4 "Range of current about the bias" annotation (Dialog(group = "Data sheet"));
  parameter Types.Position stroke(min = 0) = 50e-6 "Free stroke over this range" annotation (Dialog(group = "Data sheet"));
  parameter Real L(unit = "H", min = 0) = 0.01 "Inductance without load, mean over this range" annotation (Dialog(group = "Data sheet"));
  parameter Types.Resistance resistance(min = 0) = 2 "Resistance of the coil" annotation (Dialog(group = "Data sheet"));
  parameter Types.Stiffness k(min = 0) = 6e7 "Stiffness at constant magnetisation, greater than 0" annotation (Dialog(group = "Data sheet"));
  parameter Types.Mass m(min = 0) = 0.1 "Moving mass at flange_b, greater than 0" annotation (Dialog(group = "Data sheet"));
  parameter Boolean withMass = true "Is there a mass at flange_b? false if another mass is joined rigidly" annotation (Dialog(group = "Data sheet"));
  parameter Types.Damping c(min = 0) = 200 "Damping between the flanges, greater than 0" annotation (Dialog(group = "Data sheet"));
  parameter Types.Time tau(min = 0) = 1e-4 "Lag of the field behind the current by eddy currents, greater than 0" annotation (Dialog(group = "Data sheet"));
  parameter Types.Stiffness k_pre(min = 0) = 0 "Stiffness of the spring that preloads it" annotation (Dialog(group = "Preload"));
  parameter Types.Start start = Types.Start.rest "At i_start without load, or in equilibrium with what is connected" annotation (Dialog(group = "Start"));
  parameter Real i_start(unit = "A") = 0 "Current at the start; where the memory begins" annotation (Dialog(group = "Start"));
  parameter Types.Temperature T_fixed = 293.15 "Temperature that the hysteresis follows, if its class does" annotation (Dialog(tab = "Advanced"));
  parameter Real share(min = 0, max = 1) = 0.9 "Part of L that the moving magnetisation has, between 0 and 1" annotation (Dialog(tab = "Advanced"));
  Interfaces.Pin pin_p "Positive pin" annotation (Placement(transformation(extent = {{-120, 40}, {-100, 60}})));
  Interfaces.Pin pin_n "Negative pin" annotation (Placement(transformation(extent = {{-120, -60}, {-100, -40}})));
  Interfaces.Flange flange_a "End that is mostly fixed" annotation (Placement(transformation(extent = {{-10, -120}, {10, -100}})));
  Interfaces.Flange flange_b "End that moves" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  replaceable Actuators.Hysteresis.PrandtlIshlinskii hysteresis(u_start = ohm*i_start, gain = 1/(ohm*i_max), scale = stroke/1.025)
    constrainedby BaseClasses.Hysteresis(u_start = ohm*i_start, gain = 1/(ohm*i_max), scale = stroke/1.025) "From current to free stroke; 1 V in its slot is 1 A" annotation (choicesAllMatching = true, Placement(transformation(extent = {{-40, -10}, {-20, 10}})));
  Elastic elastic(k = k, c = c, k_pre = k_pre, stroke_start = hysteresis.y_start) "Rod and preload" annotation (Placement(transformation(extent = {{10, -10}, {30, 10}})));
  Inertia inertia(m = m, start = start) if withMass "Moving mass" annotation (Placement(transformation(extent = {{60, 30}, {80, 50}})));
  Real e(unit = "A", nominal = 1) "Current that the magnetisation follows: that of the coil less that of the eddies";
  Real driving(unit = "A", nominal = 1) "Current, and what the tension adds to it";
  Real P(unit = "Wb", nominal = 1e-2) "Flux linkage of the magnetisation";
  Real flux(unit = "Wb", nominal = 1e-2) "Flux linkage of the coil";
  Types.Power loss "Power that becomes heat, over closed cycles: in the coil, by damping, eddies and hysteresis";
  Types.Energy dissipated(start = 0, fixed = true, nominal = 1e-3) "Heat since the start";
  Types.Energy supplied(start = 0, fixed = true, nominal = 1e-3) "Electrical and mechanical work since the start";
  Types.Energy stored(nominal = 1e-3) "Energy in coil, spring and memory; the mass has its own";
  Types.Energy residual(nominal = 1e-3) "Supplied less stored and dissipated; its change is the error of the balance";
protected
  constant Types.Resistance ohm = 1 "The slot takes volts";
  parameter Real d(unit = "m/Wb") = stroke/(share*L*i_max) "Stroke of a flux linkage, and current of a force";
  Real dP(unit = "V") "Rate of P";
  Real rate(unit = "A/s") "Rate of e";
initial equation
  if start == Types.Start.steady then
    der(flux) = 0;
    e = driving;
  else
    flux = hysteresis.y_rest/d + (1 - share)*L*i_start;
    e = i_start;
  end if;
equation
  assert(hysteresis.passive, "The passivity of this hysteresis is not shown: a closed cycle may give energy back, see dissipated and residual", AssertionLevel.warning);
  pin_p.i + pin_n.i = 0;
  pin_p.v - pin_n.v = resistance*pin_p.i + der(flux);
  flux = P + (1 - share)*L*pin_p.i;
  P = hysteresis.y/d;
  dP = hysteresis.dy/d;
  driving = pin_p.i + d*elastic.F;
  rate = (driving - e)/tau;
  der(e) = rate;
  hysteresis.u = ohm*e;
  hysteresis.du = ohm*rate;
  hysteresis.temperature = T_fixed;
  connect(hysteresis.y, elastic.stroke) annotation (Line(points = {{-19, 0}, {0.5, 0}, {0.5, 11}, {20, 11}}, color = {0, 0, 127}));
  connect(elastic.flange_a, flange_a) annotation (Line(points = {{9, 0}, {15, 0}, {15, -130}, {-6, -130}, {-6, -110}, {0, -110}}, color = {0, 127, 0}));
  connect(elastic.flange_b, flange_b) annotation (Line(points = {{31, 0}, {110, 0}}, color = {0, 127, 0}));
  connect(elastic.rest, inertia.rest) annotation (Line(points = {{31, 6}, {45, 6}, {45, 46}, {59, 46}}, color = {0, 0, 127}));
  connect(inertia.flange, flange_b) annotation (Line(points = {{59, 40}, {84.5, 40}, {84.5, 0}, {110, 0}}, color = {0, 127, 0}));
  loss = resistance*pin_p.i^2 + c*elastic.v_rel^2 + (driving - e)*dP + hysteresis.heat/(ohm*d);
  der(dissipated) = loss;
  der(supplied) = (pin_p.v - pin_n.v)*pin_p.i + elastic.flange_b.f*elastic.v_rel;
  stored = 0.5*(1 - share)*L*pin_p.i^2 + hysteresis.stored/(ohm*d) + elastic.stored;
  residual = supplied - stored - dissipated;
  annotation (
    Icon(graphics = {Line(points = {{-100, 50}, {-80, 50}}, color = {0, 0, 255}), Line(points = {{-100, -50}, {-80, -50}}, color = {0, 0, 255}), Line(points = {{80, 0}, {100, 0}}, color = {0, 127, 0})}),
    Documentation(info = "<html>
<p><b>Equation:</b> with F the tension: v = R i + flux', flux = P + (1 - share) L i, P = H[e]/d, tau e' = driving - e, driving = i + d F, x = d P + F/k. H gives the free stroke; d = stroke/(share L i_max). It is the dual of Actuators.BaseClasses.Piezo: current for voltage, flux linkage for charge.</p>
<p><b>Power:</b> i flux' + F x' = stored' + loss; (driving - e) P' is the loss of the eddy currents.</p>
<p><b>Eddy currents:</b> tau = mu sigma a<sup>2</sup>/5.78, the slowest mode of the diffusion into a round rod of radius a; the faster modes are left out.</p>
<p><b>Source:</b> Engdahl, Handbook of Giant Magnetostrictive Materials, Academic Press 2000: linear equations of a rod, with the magnetisation of an identified model in the place of the linear one.</p>
<p><b>Limitations:</b> about a bias of field and stress: the stroke is not even in the current; one lumped mass; the leakage is constant; no heat port.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MagnetostrictiveRod\">Examples.MagnetostrictiveRod</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.MagnetostrictiveRod\">Actuators.MagnetostrictiveRod</a>, <a href=\"modelica://HystFMU.Actuators.CurrentDrive\">Actuators.CurrentDrive</a>, <a href=\"modelica://HystFMU.Actuators.BaseClasses.Piezo\">Actuators.BaseClasses.Piezo</a>.</p>
</html>"));
end Magnetostrictive;
