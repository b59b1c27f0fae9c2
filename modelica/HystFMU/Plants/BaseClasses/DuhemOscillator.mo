// generated from the table of fmu_build/core/blocks/dynamics/duhem_oscillator.c by `make generate` - do not edit
within HystFMU.Plants.BaseClasses;
partial block DuhemOscillator "Oscillator with a Duhem force of any shape: parameters and ports"
  extends Icons.Hysteresis;
  parameter Integer n(min = 2) = 5 "Number of knots of f" annotation (Dialog(group = "Sizes"));
  parameter Types.Mass m_L(min = 1e-100, max = 1e100) = 2 "Mass" annotation (Dialog(group = "Dynamics"));
  parameter Types.Damping c_L(min = 0, max = 1e100) = 10 "Viscous damping" annotation (Dialog(group = "Dynamics"));
  parameter Types.Stiffness k_L(min = 0, max = 1e100) = 50000 "Linear stiffness" annotation (Dialog(group = "Dynamics"));
  parameter Types.Stiffness f[n](each min = -1e100, each max = 1e100) = fill(50000.0, n) "Stiffness of the hysteretic force at the knots" annotation (Dialog(group = "Dynamics"));
  parameter Types.Force z_max(min = 1e-100, max = 1e100) = 100 "Largest knot; the smallest is -z_max" annotation (Dialog(group = "Limits"));
  Interfaces.RealInput u(unit = "N") "Force" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y(unit = "m") "Displacement" annotation (Placement(transformation(extent = {{100, 30}, {120, 50}})));
  Interfaces.RealOutput z(unit = "N") "Hysteretic force" annotation (Placement(transformation(extent = {{100, -50}, {120, -30}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> m_L y'' + c_L y' + k_L y + z = u; dz/dy = f(s z), s = sgn(y'), f linear between its knots.</p>
<p><b>Source:</b> Oh &amp; Bernstein 2005 (Duhem's form); Noel &amp; Schoukens 2016 (the oscillator).</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.DuhemOscillator\">Validation.DuhemOscillator</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Plants.DuhemOscillator\">Plants.DuhemOscillator</a>.</p>
</html>"));
end DuhemOscillator;
