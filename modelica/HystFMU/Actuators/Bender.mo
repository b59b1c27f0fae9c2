within HystFMU.Actuators;
model Bender "Bimorph bender clamped at one end; the fields of its two layers are along and against the polarisation"
  parameter Types.Position L(min = 0) = 40e-3 "Free length" annotation (Dialog(group = "Geometry"));
  parameter Types.Position b(min = 0) = 10e-3 "Width" annotation (Dialog(group = "Geometry"));
  parameter Types.Position h(min = 0) = 0.6e-3 "Height of both layers" annotation (Dialog(group = "Geometry"));
  parameter Real d31(unit = "m/V", min = 0) = 190e-12 "Absolute value of the transverse piezoelectric coefficient, mean over the range" annotation (Dialog(group = "Material"));
  parameter Real E(quantity = "Pressure", unit = "Pa", min = 0) = 62e9 "Young's modulus in short circuit" annotation (Dialog(group = "Material"));
  parameter Real permittivity(unit = "F/m", min = 0) = 1.6e-8 "Permittivity without stress, mean over the range" annotation (Dialog(group = "Material"));
  parameter Real density(unit = "kg/m3", min = 0) = 7800 "Density" annotation (Dialog(group = "Material"));
  parameter Real zeta(min = 0) = 0.02 "Damping ratio of the first mode" annotation (Dialog(group = "Material"));
  final parameter Types.Stiffness k_short = E*b*h^3/(4*L^3) "Stiffness of the tip in short circuit";
  final parameter Real coupling = 9/16*d31^2*E/permittivity "Square of the coupling factor of the bender; must be less than 1";
  extends BaseClasses.Piezo(v_max = 60, final stroke = 3*d31*L^2*v_max/h^2, final C = 4*permittivity*b*L/h, final share = 0.9 + 0.1*coupling, final k = k_short/(1 - coupling/(0.9 + 0.1*coupling)), m = 0.2427*density*b*h*L, final c = 2*zeta*sqrt(0.2427*density*b*h*L*k_short));
equation
  assert(coupling < 1, "The material must have 9/16 d31^2 E < permittivity: else the bender gives more work than it takes");
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> stroke of the tip without load 3 d31 L<sup>2</sup> v/h<sup>2</sup>, stiffness of the tip E b h<sup>3</sup>/(4 L<sup>3</sup>), capacitance 4 permittivity b L/h, mass of the first mode 0.2427 times the total mass.</p>
<p><b>Heat:</b> as in Actuators.BaseClasses.Piezo; at least 0 at every instant with the default hysteresis.</p>
<p><b>Source:</b> Smits, Dalke &amp; Cooney, Sensors and Actuators A 28 (1991) 41-61; Euler-Bernoulli beam.</p>
<p><b>Limitations:</b> electrically parallel bimorph; first mode; small angles; no passive layer.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.Bender\">Examples.Bender</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.Stack\">Actuators.Stack</a>, <a href=\"modelica://HystFMU.Actuators.BaseClasses.Piezo\">Actuators.BaseClasses.Piezo</a>.</p>
</html>"));
end Bender;
