// generated from the table of fmu_build/core/blocks/dynamics/sum.c by `make generate` - do not edit
within HystFMU.Dynamics.BaseClasses;
partial block Sum "Weighted sum of signals: parameters and ports"
  extends Icons.Block;
  parameter Integer n(min = 1) = 2 "Number of signals" annotation (Dialog(group = "Sizes"));
  parameter Real k[n] = fill(1.0, n) "Weights" annotation (Dialog(group = "Weights"));
  parameter Real offset = 0 "Constant term" annotation (Dialog(group = "Offset"));
  Interfaces.RealInput u[n] "Inputs" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y "Weighted sum" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = offset + sum_i k_i u_i.</p>
<p><b>Source:</b> linear readout.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.RateDependence\">Examples.RateDependence</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.Sum\">Dynamics.Sum</a>, <a href=\"modelica://HystFMU.Validation.Sum\">Validation.Sum</a>.</p>
</html>"));
end Sum;
