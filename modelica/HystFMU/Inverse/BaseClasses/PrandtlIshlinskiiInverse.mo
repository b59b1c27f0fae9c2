// generated from the table of fmu_build/core/blocks/inverses/prandtl_ishlinskii_inverse.c by `make generate` - do not edit
within HystFMU.Inverse.BaseClasses;
partial block PrandtlIshlinskiiInverse "Exact inverse of the Prandtl-Ishlinskii operator: parameters and ports"
  extends Icons.Inverse;
  parameter Integer n(min = 1) = 10 "Number of play operators" annotation (Dialog(group = "Sizes"));
  parameter Integer depth(min = 4) = 16 "Maximum number of stored extrema" annotation (Dialog(group = "Memory"));
  parameter Real w0(min = 0) = 1 "Weight of the linear term, greater than 0" annotation (Dialog(group = "Weights"));
  parameter Real r[n](each min = 0) = fill(0.1, n) "Thresholds (play half-widths), not decreasing" annotation (Dialog(group = "Thresholds"));
  parameter Real w[n] = fill(0.1, n) "Weights of the plays" annotation (Dialog(group = "Weights"));
  parameter Real u0 = 0 "Initial memory: every play rests at this value of u" annotation (Dialog(group = "Start"));
  Interfaces.RealInput y "Wanted output of the operator" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput dy(unit = "1/s") if usesRate "Rate of y; Sampled has no such input" annotation (Placement(transformation(extent = {{-120, -80}, {-100, -60}})));
  Interfaces.RealOutput u "Operator input for the output y" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  constant Boolean usesRate = false "True if there is an input for the rate";
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> u such that w0 u + sum_i w_i p_{r_i}[u] = y.</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 10-14.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.Cascade\">Examples.Cascade</a>.</p>
<p><b>Any realisation:</b> <code>replaceable Inverse.Sampled.PrandtlIshlinskiiInverse inverse constrainedby Inverse.BaseClasses.PrandtlIshlinskiiInverse;</code></p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Sampled.PrandtlIshlinskiiInverse\">Inverse.Sampled.PrandtlIshlinskiiInverse</a>, <a href=\"modelica://HystFMU.Inverse.Events.PrandtlIshlinskiiInverse\">Inverse.Events.PrandtlIshlinskiiInverse</a>, <a href=\"modelica://HystFMU.Examples.Pid\">Examples.Pid</a>, <a href=\"modelica://HystFMU.Validation.Sampled.PrandtlIshlinskiiInverse\">Validation.Sampled.PrandtlIshlinskiiInverse</a>.</p>
</html>"));
end PrandtlIshlinskiiInverse;
