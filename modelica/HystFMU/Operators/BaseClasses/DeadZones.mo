// generated from the table of fmu_build/core/blocks/operators/dead_zones.c by `make generate` - do not edit
within HystFMU.Operators.BaseClasses;
partial block DeadZones "Weighted sum of one-sided dead zones: parameters and ports"
  extends Icons.Block;
  parameter Integer n(min = 1) = 6 "Number of dead zones" annotation (Dialog(group = "Sizes"));
  parameter Real w0 = 1 "Weight of the linear term" annotation (Dialog(group = "Weights"));
  parameter Real r[n] = fill(0.1, n) "Thresholds; the sign selects the side" annotation (Dialog(group = "Thresholds"));
  parameter Real w[n] = fill(0.1, n) "Weights of the dead zones" annotation (Dialog(group = "Weights"));
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y "Output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = w0 u + sum_i w_i S(u, r_i); S = max(u - r, 0) for r &gt; 0, min(u - r, 0) for r &lt; 0, u for r = 0.</p>
<p><b>Source:</b> Kuhnen 2003.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.DeadZones\">Validation.DeadZones</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.DeadZones\">Operators.DeadZones</a>.</p>
</html>"));
end DeadZones;
