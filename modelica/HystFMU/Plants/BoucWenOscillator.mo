within HystFMU.Plants;
block BoucWenOscillator "Oscillator with a Bouc-Wen force: the hysteretic benchmark plant"
  extends Icons.Hysteresis;
  parameter Real m_L(unit = "kg", min = 1e-100, max = 1e100) = 2 "Mass";
  parameter Real c_L(unit = "N.s/m", min = 0, max = 1e100) = 10 "Viscous damping";
  parameter Real k_L(unit = "N/m", min = 0, max = 1e100) = 5e4 "Linear stiffness";
  parameter Real alpha(unit = "N/m", min = 0, max = 1e100) = 5e4 "Stiffness of the hysteretic force at z = 0";
  parameter Real beta(unit = "1/m", min = 0, max = 1e100) = 1e3 "Weight of the loop; its unit belongs to nu = 1";
  parameter Real gamma(min = -1e100, max = 1e100) = 0.8 "Shape of the loop";
  parameter Real delta(min = -1e100, max = 1e100) = -1.1 "Shape of the loop";
  parameter Real nu(min = 1, max = 20) = 1 "Sharpness of the knee";
  Interfaces.RealInput u(unit = "N") "Force" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y(unit = "m", start = 0, fixed = true) "Displacement" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  Interfaces.RealOutput z(unit = "N", start = 0, fixed = true) "Hysteretic force" annotation (Placement(transformation(extent = {{100, -70}, {120, -50}})));
  Real v(unit = "m/s", start = 0, fixed = true) "Velocity";
equation
  der(y) = v;
  m_L*der(v) = u - c_L*v - k_L*y - z;
  der(z) = noEvent(alpha*v - beta*(gamma*abs(v)*(if z >= 0 then 1 else -1) + delta*v)*abs(z)^nu);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> m_L y'' + c_L y' + k_L y + z = u, z' = alpha y' - beta (gamma abs(y') abs(z)<sup>nu-1</sup> z + delta y' abs(z)<sup>nu</sup>).</p>
<p><b>Source:</b> Noel &amp; Schoukens, Hysteretic benchmark with a dynamic nonlinearity, 2016, eq. 1-2.</p>
<p><b>Limitations:</b> continuous: the accuracy is the solver's. The unit takes Newmark steps, with an error of second order.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.BoucWenOscillator\">Validation.BoucWenOscillator</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Smooth.BoucWen\">Operators.Smooth.BoucWen</a>.</p>
</html>"));
end BoucWenOscillator;
