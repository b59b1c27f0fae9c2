// generated from the table of fmu_build/core/blocks/operators/backlash_sum.c by `make generate` - do not edit
within HystFMU.Operators.BaseClasses;
partial block BacklashSum "Weighted sum of backlash (play) operators, plain states: parameters and ports"
  extends Icons.Hysteresis;
  parameter Integer n(min = 1) = 10 "Number of backlash operators" annotation (Dialog(group = "Sizes"));
  parameter Real w0 = 0 "Weight of the linear term" annotation (Dialog(group = "Weights"));
  parameter Real r[n](each min = 0) = fill(0.1, n) "Half-widths of the plays" annotation (Dialog(group = "Thresholds"));
  parameter Real w[n] = fill(0.1, n) "Weights of the plays" annotation (Dialog(group = "Weights"));
  parameter Real z0[n] = fill(0.0, n) "Initial play states" annotation (Dialog(group = "Start"));
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput du(unit = "1/s") if usesRate "Rate of u; Sampled has no such input" annotation (Placement(transformation(extent = {{-120, -80}, {-100, -60}})));
  Interfaces.RealOutput y "Output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  constant Boolean usesRate = false "True if there is an input for the rate";
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> z_i = max(u - r_i, min(u + r_i, z_i)), y = w0 u + sum_i w_i z_i.</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, section II; Krejci &amp; Kuhnen 2001, eq. 3.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Sampled.BacklashSum\">Validation.Sampled.BacklashSum</a>.</p>
<p><b>Any realisation:</b> <code>replaceable Operators.Sampled.BacklashSum hysteresis constrainedby Operators.BaseClasses.BacklashSum;</code></p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.BacklashSum\">Operators.Sampled.BacklashSum</a>, <a href=\"modelica://HystFMU.Operators.Events.BacklashSum\">Operators.Events.BacklashSum</a>, <a href=\"modelica://HystFMU.Operators.Smooth.BacklashSum\">Operators.Smooth.BacklashSum</a>.</p>
</html>"));
end BacklashSum;
