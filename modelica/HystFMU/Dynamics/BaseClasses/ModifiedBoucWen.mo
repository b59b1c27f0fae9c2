// generated from the table of fmu_build/core/blocks/dynamics/modified_bouc_wen.c by `make generate` - do not edit
within HystFMU.Dynamics.BaseClasses;
partial block ModifiedBoucWen "Modified Bouc-Wen model of a magnetorheological damper: parameters and ports"
  extends Icons.Block;
  parameter Types.Damping c_0(min = 0, max = 1e100) = 0.1 "Damping parallel to the operator" annotation (Dialog(group = "Dynamics"));
  parameter Types.Damping c_1(min = 1e-100, max = 1e100) = 2 "Damping in series with the operator" annotation (Dialog(group = "Dynamics"));
  parameter Types.Stiffness k_0(min = 0, max = 1e100) = 0.2 "Stiffness parallel to the operator" annotation (Dialog(group = "Dynamics"));
  parameter Types.Stiffness k_1 = 0.05 "Stiffness parallel to both dashpots" annotation (Dialog(group = "Dynamics"));
  parameter Types.Position x_0 = 0 "Offset: displacement at which k_1 has no force" annotation (Dialog(group = "Offset"));
  parameter Types.Stiffness alpha(min = 0, max = 1e100) = 5 "Weight of z in the force" annotation (Dialog(group = "Weights"));
  parameter Real A(min = 1e-100, max = 1e100) = 1 "Slope of z at z = 0" annotation (Dialog(group = "Dynamics"));
  parameter Real beta(unit = "1/m2", min = -1e100, max = 1e100) = 4 "Shape of the loop; beta + gamma > 0 (unit for n = 2)" annotation (Dialog(group = "Dynamics"));
  parameter Real gamma(unit = "1/m2", min = 0, max = 1e100) = 4 "Width of the loop (unit for n = 2)" annotation (Dialog(group = "Dynamics"));
  parameter Real n(min = 1, max = 20) = 2 "Sharpness of the knee" annotation (Dialog(group = "Dynamics"));
  parameter Types.Position z0 = 0 "Initial z; at most z_max in absolute value" annotation (Dialog(group = "Start"));
  Interfaces.RealInput u(unit = "m") "Displacement" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y(unit = "N") "Force" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> c_1 w' = alpha z + k_0 d + c_0 d', d = u - w, z' = A d' - gamma |d'| |z|<sup>n-1</sup> z - beta d' |z|<sup>n</sup>, y = c_1 w' + k_1 (u - x_0).</p>
<p><b>Source:</b> Spencer, Dyke, Sain &amp; Carlson 1997.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.ModifiedBoucWen\">Validation.ModifiedBoucWen</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.ModifiedBoucWen\">Dynamics.ModifiedBoucWen</a>.</p>
</html>"));
end ModifiedBoucWen;
