within HystFMU.Actuators.BaseClasses;
partial model Magnetostrictive "Magnetostrictive actuator with pins and flanges, and a replaceable identified hysteresis"
  extends Icons.Component;
  parameter Real i_max(unit = "A", min = 0) = 4 "Range of current about the bias" annotation (Dialog(group = "Data sheet"));
  parameter Types.Position stroke(min = 0) = 50e-6 "Free stroke over this range" annotation (Dialog(group = "Data sheet"));
  parameter Real L(unit = "H", min = 0) = 0.01 "Inductance without load, mean over this range" annotation (Dialog(group = "Data sheet"));
  parameter Types.Resistance resistance(min = 0) = 2 "Resistance of the coil" annotation (Dialog(group = "Data sheet"));
  parameter Types.Stiffness k(min = 0) = 6e7 "Stiffness at constant magnetisation, greater than 0" annotation (Dialog(group = "Data sheet"));
  parameter Types.Mass m(min = 0) = 0.1 "Moving mass at flange_b, greater than 0" annotation (Dialog(group = "Data sheet"));
  parameter Boolean withMass = true "True if the actuator has a mass; false if a rigid load has the mass" annotation (Dialog(group = "Data sheet"));
  parameter Types.Damping c(min = 0) = 200 "Damping between the flanges, greater than 0" annotation (Dialog(group = "Data sheet"));
  parameter Types.Time tau(min = 0) = 1e-4 "Time constant of the eddy currents, greater than 0" annotation (Dialog(group = "Data sheet"));
  parameter Types.Stiffness k_pre(min = 0) = 0 "Stiffness of the preload spring" annotation (Dialog(group = "Preload"));
  parameter Types.Start start = Types.Start.rest "Initial state: at i_start without load, or in equilibrium" annotation (Dialog(group = "Start"));
  parameter Real i_start(unit = "A") = 0 "Initial current, also of the memory" annotation (Dialog(group = "Start"));
  parameter Types.Temperature T_fixed = 293.15 "Temperature of the hysteresis, if its class uses it" annotation (Dialog(tab = "Advanced"));
  parameter Real share(min = 0, max = 1) = 0.9 "Share of L that is due to the hysteresis, between 0 and 1" annotation (Dialog(tab = "Advanced"));
  Interfaces.Pin pin_p "Positive pin" annotation (Placement(transformation(extent = {{-120, 40}, {-100, 60}})));
  Interfaces.Pin pin_n "Negative pin" annotation (Placement(transformation(extent = {{-120, -60}, {-100, -40}})));
  Interfaces.Flange flange_a "Fixed end" annotation (Placement(transformation(extent = {{-10, -120}, {10, -100}})));
  Interfaces.Flange flange_b "Moving end" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  replaceable Actuators.Hysteresis.PrandtlIshlinskii hysteresis(u_start = ohm*i_start, gain = 1/(ohm*i_max), scale = stroke/1.025)
    constrainedby BaseClasses.Hysteresis(u_start = ohm*i_start, gain = 1/(ohm*i_max), scale = stroke/1.025) "Hysteresis from current to free stroke; 1 A corresponds to 1 V" annotation (choicesAllMatching = true, Placement(transformation(extent = {{-40, -10}, {-20, 10}})));
  Elastic elastic(k = k, c = c, k_pre = k_pre, stroke_start = hysteresis.y_start) "Rod and preload" annotation (Placement(transformation(extent = {{10, -10}, {30, 10}})));
  Inertia inertia(m = m, start = start) if withMass "Moving mass" annotation (Placement(transformation(extent = {{60, 30}, {80, 50}})));
  Real e(unit = "A", nominal = 1) "Current that determines the magnetisation: coil current without eddy currents";
  Real driving(unit = "A", nominal = 1) "Current plus the current due to the tension";
  Real P(unit = "Wb", nominal = 1e-2) "Flux linkage of the magnetisation";
  Real flux(unit = "Wb", nominal = 1e-2) "Flux linkage of the coil";
  Types.Power loss "Heating power of coil, damping, eddy currents and hysteresis, mean over closed cycles";
  Types.Energy dissipated(start = 0, fixed = true, nominal = 1e-3) "Heat since the start";
  Types.Energy supplied(start = 0, fixed = true, nominal = 1e-3) "Electrical and mechanical work since the start";
  Types.Energy stored(nominal = 1e-3) "Energy in coil, spring and memory, without the mass";
  Types.Energy residual(nominal = 1e-3) "supplied - stored - dissipated; its change is the error of the energy balance";
protected
  constant Types.Resistance ohm = 1 "Conversion of the current to the voltage at the slot";
  parameter Real d(unit = "m/Wb") = stroke/(share*L*i_max) "Stroke per flux linkage, equal to current per force";
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
  assert(hysteresis.passive, "The passivity of this hysteresis is not proven: a closed cycle may generate energy, see the variables dissipated and residual", AssertionLevel.warning);
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
<p><b>Equation:</b> with tension F: v = R i + flux', flux = P + (1 - share) L i, P = H[e]/d, tau e' = driving - e, driving = i + d F, x = d P + F/k. H gives the free stroke; d = stroke/(share L i_max). The model is the dual of Actuators.BaseClasses.Piezo, with current in place of voltage and flux linkage in place of charge.</p>
<p><b>Power:</b> i flux' + F x' = stored' + loss; (driving - e) P' is the loss of the eddy currents.</p>
<p><b>Eddy currents:</b> tau = mu sigma a<sup>2</sup>/5.78, the time constant of the slowest diffusion mode in a round rod of radius a; faster modes are neglected.</p>
<p><b>Source:</b> Engdahl, Handbook of Giant Magnetostrictive Materials, Academic Press 2000: linear equations of a rod, with the magnetisation of an identified model in the place of the linear one.</p>
<p><b>Limitations:</b> valid near a bias of field and stress, where the stroke is not an even function of the current; one lumped mass; constant leakage; no heat port.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MagnetostrictiveRod\">Examples.MagnetostrictiveRod</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.MagnetostrictiveRod\">Actuators.MagnetostrictiveRod</a>, <a href=\"modelica://HystFMU.Actuators.CurrentDrive\">Actuators.CurrentDrive</a>, <a href=\"modelica://HystFMU.Actuators.BaseClasses.Piezo\">Actuators.BaseClasses.Piezo</a>.</p>
</html>"));
end Magnetostrictive;
