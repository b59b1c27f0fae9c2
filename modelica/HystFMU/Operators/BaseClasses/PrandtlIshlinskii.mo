// generated from the table of fmu_build/core/blocks/operators/prandtl_ishlinskii.c by `make generate` - do not edit
within HystFMU.Operators.BaseClasses;
partial block PrandtlIshlinskii "Prandtl-Ishlinskii operator: linear term plus weighted plays: parameters and ports"
  extends Icons.Hysteresis;
  parameter Integer n(min = 1) = 10 "Number of play operators" annotation (Dialog(group = "Sizes"));
  parameter Integer depth(min = 4) = 16 "Maximum number of stored extrema" annotation (Dialog(group = "Memory"));
  parameter Real w0 = 0 "Weight of the linear term" annotation (Dialog(group = "Weights"));
  parameter Real r[n](each min = 0) = fill(0.1, n) "Thresholds (play half-widths), not decreasing" annotation (Dialog(group = "Thresholds"));
  parameter Real w[n] = fill(0.1, n) "Weights of the plays" annotation (Dialog(group = "Weights"));
  parameter Real u0 = 0 "Initial memory: every play rests at this value of u" annotation (Dialog(group = "Start"));
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput du(unit = "1/s") if usesRate "Rate of u; Sampled has no such input" annotation (Placement(transformation(extent = {{-120, -80}, {-100, -60}})));
  Interfaces.RealOutput y "Output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  constant Boolean usesRate = false "True if there is an input for the rate";
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = w0 u + sum_i w_i p_{r_i}[u].</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 5-9; Zhao &amp; Tan 2008, section II.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>.</p>
<p><b>Any realisation:</b> <code>replaceable Operators.Sampled.PrandtlIshlinskii hysteresis constrainedby Operators.BaseClasses.PrandtlIshlinskii;</code></p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.PrandtlIshlinskii\">Operators.Sampled.PrandtlIshlinskii</a>, <a href=\"modelica://HystFMU.Operators.Events.PrandtlIshlinskii\">Operators.Events.PrandtlIshlinskii</a>, <a href=\"modelica://HystFMU.Operators.Smooth.PrandtlIshlinskii\">Operators.Smooth.PrandtlIshlinskii</a>, <a href=\"modelica://HystFMU.Examples.RateDependence\">Examples.RateDependence</a>, <a href=\"modelica://HystFMU.Validation.Sampled.PrandtlIshlinskii\">Validation.Sampled.PrandtlIshlinskii</a>.</p>
</html>"));
end PrandtlIshlinskii;
