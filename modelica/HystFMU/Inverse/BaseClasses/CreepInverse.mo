// generated from the table of fmu_build/core/blocks/inverses/creep_inverse.c by `make generate` - do not edit
within HystFMU.Inverse.BaseClasses;
partial block CreepInverse "Exact inverse of creep: parameters and ports"
  extends Icons.Inverse;
  parameter Integer n(min = 1) = 1 "Number of lags" annotation (Dialog(group = "Sizes"));
  parameter Real w[n] = fill(1.0, n) "Weights of the lags" annotation (Dialog(group = "Weights"));
  parameter Types.Time T[n](each min = 0) = fill(1.0, n) "Time constants; greater than 0" annotation (Dialog(group = "Dynamics"));
  parameter Real w0 = 1 "Weight of the direct input, not 0" annotation (Dialog(group = "Weights"));
  parameter Types.Start start = Types.Start.rest "Initial lags: 0, or the first output" annotation (Dialog(group = "Start"));
  Interfaces.RealInput u "Wanted output of the creep" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y "Creep input for the output u" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = (u - sum_i w_i q_i)/w0; q_i: first-order lags of y, held over a step.</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Sampled.CreepInverse\">Validation.Sampled.CreepInverse</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Sampled.CreepInverse\">Inverse.Sampled.CreepInverse</a>.</p>
</html>"));
end CreepInverse;
