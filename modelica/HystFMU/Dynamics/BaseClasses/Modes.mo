// generated from the table of fmu_build/core/blocks/dynamics/modes.c by `make generate` - do not edit
within HystFMU.Dynamics.BaseClasses;
partial block Modes "Second-order modes in parallel, discretised exactly: parameters and ports"
  extends Icons.Block;
  parameter Integer n(min = 1) = 1 "Number of modes" annotation (Dialog(group = "Sizes"));
  parameter Types.Frequency f_n[n](each min = 0, each max = 1e12) = fill(1.0, n) "Natural frequencies; greater than 0" annotation (Dialog(group = "Dynamics"));
  parameter Real zeta[n](each min = 0, each max = 1e06) = fill(0.02, n) "Damping ratios" annotation (Dialog(group = "Dynamics"));
  parameter Real k[n] = fill(1.0, n) "Static gains" annotation (Dialog(group = "Gains"));
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y "Sum of the modes" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = sum_i k_i omega_i<sup>2</sup> / (s<sup>2</sup> + 2 zeta_i omega_i s + omega_i<sup>2</sup>) u, omega_i = 2 pi f_n_i.</p>
<p><b>Source:</b> Preumont 2011, section 2.4.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Modes\">Validation.Modes</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.Modes\">Dynamics.Modes</a>.</p>
</html>"));
end Modes;
