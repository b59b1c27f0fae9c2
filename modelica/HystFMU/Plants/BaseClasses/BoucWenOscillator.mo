// generated from the table of fmu_build/core/blocks/dynamics/bouc_wen_oscillator.c by `make generate` - do not edit
within HystFMU.Plants.BaseClasses;
partial block BoucWenOscillator "Oscillator with a Bouc-Wen force: the hysteretic benchmark plant: parameters and ports"
  extends Icons.Hysteresis;
  parameter Types.Mass m_L(min = 1e-100, max = 1e100) = 2 "Mass" annotation (Dialog(group = "Dynamics"));
  parameter Types.Damping c_L(min = 0, max = 1e100) = 10 "Viscous damping" annotation (Dialog(group = "Dynamics"));
  parameter Types.Stiffness k_L(min = 0, max = 1e100) = 50000 "Linear stiffness" annotation (Dialog(group = "Dynamics"));
  parameter Types.Stiffness alpha(min = 0, max = 1e100) = 50000 "Stiffness of the hysteretic force at z = 0" annotation (Dialog(group = "Dynamics"));
  parameter Real beta(unit = "1/m", min = 0, max = 1e100) = 1000 "Weight of the loop (unit of measure valid for nu = 1)" annotation (Dialog(group = "Weights"));
  parameter Real gamma(min = -1e100, max = 1e100) = 0.8 "Shape of the loop" annotation (Dialog(group = "Dynamics"));
  parameter Real delta(min = -1e100, max = 1e100) = -1.1 "Shape of the loop" annotation (Dialog(group = "Dynamics"));
  parameter Real nu(min = 1, max = 20) = 1 "Sharpness of the knee" annotation (Dialog(group = "Dynamics"));
  Interfaces.RealInput u(unit = "N") "Force" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y(unit = "m") "Displacement" annotation (Placement(transformation(extent = {{100, 30}, {120, 50}})));
  Interfaces.RealOutput z(unit = "N") "Hysteretic force" annotation (Placement(transformation(extent = {{100, -50}, {120, -30}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> m_L y'' + c_L y' + k_L y + z = u; z' = alpha y' - beta (gamma |y'| |z|<sup>nu-1</sup> z + delta y' |z|<sup>nu</sup>).</p>
<p><b>Source:</b> Noel &amp; Schoukens, Hysteretic benchmark with a dynamic nonlinearity, 2016, eq. 1-2.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.BoucWenOscillator\">Validation.BoucWenOscillator</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Plants.BoucWenOscillator\">Plants.BoucWenOscillator</a>.</p>
</html>"));
end BoucWenOscillator;
