// generated from the table of fmu_build/core/blocks/operators/creep.c by `make generate` - do not edit
within HystFMU.Operators.BaseClasses;
partial block Creep "Creep: weighted sum of the input and its first-order lags: parameters and ports"
  extends Icons.Hysteresis;
  parameter Integer n(min = 1) = 1 "Number of lags" annotation (Dialog(group = "Sizes"));
  parameter Real w[n] = fill(1.0, n) "Weights of the lags" annotation (Dialog(group = "Weights"));
  parameter Types.Time T[n](each min = 0) = fill(1.0, n) "Time constants; greater than 0" annotation (Dialog(group = "Dynamics"));
  parameter Real w0 = 0 "Weight of the direct input" annotation (Dialog(group = "Weights"));
  parameter Types.Start start = Types.Start.rest "Initial lags: 0, or the first input" annotation (Dialog(group = "Start"));
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y "Output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> q_i' = (u - q_i)/T_i, y = w0 u + sum_i w_i q_i.</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.RateDependence\">Examples.RateDependence</a>.</p>
<p><b>Any realisation:</b> <code>replaceable Operators.Sampled.Creep hysteresis constrainedby Operators.BaseClasses.Creep;</code></p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.Creep\">Operators.Sampled.Creep</a>, <a href=\"modelica://HystFMU.Operators.Smooth.Creep\">Operators.Smooth.Creep</a>, <a href=\"modelica://HystFMU.Validation.Sampled.Creep\">Validation.Sampled.Creep</a>.</p>
</html>"));
end Creep;
