// generated from the table of fmu_build/core/blocks/dynamics/amplifier.c by `make generate` - do not edit
within HystFMU.Dynamics.BaseClasses;
partial block Amplifier "Piezo amplifier with limited voltage, current and bandwidth: parameters and ports"
  extends Icons.Block;
  parameter Types.Voltage u_min(min = -1e300, max = 1e300) = -20 "Lowest voltage" annotation (Dialog(group = "Limits"));
  parameter Types.Voltage u_max(min = -1e300, max = 1e300) = 130 "Highest voltage" annotation (Dialog(group = "Limits"));
  parameter Types.Current i_max(min = 0, max = 1e300) = 0.25 "Largest current; greater than 0" annotation (Dialog(group = "Limits"));
  parameter Types.Capacitance C(min = 0, max = 1e300) = 1.8e-06 "Capacitance of the actuator; greater than 0" annotation (Dialog(group = "Dynamics"));
  parameter Types.Frequency f_b(min = 0, max = 1e12) = 10000 "Bandwidth of small signals (-3 dB); greater than 0" annotation (Dialog(group = "Filters"));
  Interfaces.RealInput u(unit = "V") "Commanded voltage" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y(unit = "V") "Voltage at the actuator" annotation (Placement(transformation(extent = {{100, 30}, {120, 50}})));
  Interfaces.RealOutput excess(unit = "V") "Part of the command beyond the limits" annotation (Placement(transformation(extent = {{100, -50}, {120, -30}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y' = clamp(2 pi f_b (clamp(u, u_min, u_max) - y), -i_max/C, i_max/C).</p>
<p><b>Source:</b> Fleming &amp; Leang 2014, chapter 14.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Amplifier\">Validation.Amplifier</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.Amplifier\">Dynamics.Amplifier</a>.</p>
</html>"));
end Amplifier;
