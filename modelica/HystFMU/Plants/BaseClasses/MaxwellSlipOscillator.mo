// generated from the table of fmu_build/core/blocks/dynamics/maxwell_slip_oscillator.c by `make generate` - do not edit
within HystFMU.Plants.BaseClasses;
partial block MaxwellSlipOscillator "Oscillator with Maxwell-slip friction: parameters and ports"
  extends Icons.Hysteresis;
  parameter Integer n(min = 1) = 4 "Number of springs with a slider" annotation (Dialog(group = "Sizes"));
  parameter Types.Mass m_L(min = 1e-100, max = 1e100) = 2 "Mass" annotation (Dialog(group = "Dynamics"));
  parameter Types.Damping c_L(min = 0, max = 1e100) = 10 "Viscous damping" annotation (Dialog(group = "Dynamics"));
  parameter Types.Stiffness k_L(min = 0, max = 1e100) = 50000 "Linear stiffness" annotation (Dialog(group = "Dynamics"));
  parameter Types.Stiffness k[n](each min = 0, each max = 1e100) = fill(10000.0, n) "Stiffnesses of the springs with a slider" annotation (Dialog(group = "Dynamics"));
  parameter Types.Position r[n](each min = 0, each max = 1e100) = fill(1e-05, n) "Deflections at which the sliders yield" annotation (Dialog(group = "Thresholds"));
  Interfaces.RealInput u(unit = "N") "Force" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y(unit = "m") "Displacement" annotation (Placement(transformation(extent = {{100, 30}, {120, 50}})));
  Interfaces.RealOutput z(unit = "N") "Friction force" annotation (Placement(transformation(extent = {{100, -50}, {120, -30}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> m_L y'' + c_L y' + k_L y + z = u; z = sum_i k_i s_i, s_i a stop of half-width r_i of y.</p>
<p><b>Source:</b> Lampaert, Al-Bender &amp; Swevers 2003 (Maxwell slip); Krejci &amp; Kuhnen 2001 (the stop).</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.MaxwellSlipOscillator\">Validation.MaxwellSlipOscillator</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Plants.MaxwellSlipOscillator\">Plants.MaxwellSlipOscillator</a>.</p>
</html>"));
end MaxwellSlipOscillator;
