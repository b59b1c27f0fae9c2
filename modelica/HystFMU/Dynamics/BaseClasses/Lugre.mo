// generated from the table of fmu_build/core/blocks/dynamics/lugre.c by `make generate` - do not edit
within HystFMU.Dynamics.BaseClasses;
partial block Lugre "LuGre friction: bristles with a Stribeck curve: parameters and ports"
  extends Icons.Block;
  parameter Types.Stiffness sigma_0 = 10 "Stiffness of the bristles" annotation (Dialog(group = "Dynamics"));
  parameter Types.Damping sigma_1 = 0.1 "Damping of the bristles" annotation (Dialog(group = "Dynamics"));
  parameter Types.Damping sigma_2 = 0.1 "Viscous friction" annotation (Dialog(group = "Dynamics"));
  parameter Types.Position d_c(min = 1e-100, max = 1e100) = 0.1 "Deflection in fast motion: Coulomb friction over sigma_0" annotation (Dialog(group = "Dynamics"));
  parameter Types.Position d_s(min = 1e-100, max = 1e100) = 0.15 "Deflection in slow motion: static friction over sigma_0" annotation (Dialog(group = "Dynamics"));
  parameter Types.Velocity v_s(min = 1e-100, max = 1e100) = 0.5 "Stribeck velocity" annotation (Dialog(group = "Dynamics"));
  parameter Types.Position z0 = 0 "Initial deflection of the bristles" annotation (Dialog(group = "Start"));
  Interfaces.RealInput u(unit = "m") "Displacement" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y(unit = "N") "Friction force" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> z' = v - |v| z / d, d = d_c + (d_s - d_c) e^(-(v/v_s)<sup>2</sup>), y = sigma_0 z + sigma_1 z' + sigma_2 v, v = u'.</p>
<p><b>Source:</b> Canudas de Wit, Olsson, Astrom &amp; Lischinsky 1995, with d = g / sigma_0.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Lugre\">Validation.Lugre</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.Lugre\">Dynamics.Lugre</a>.</p>
</html>"));
end Lugre;
