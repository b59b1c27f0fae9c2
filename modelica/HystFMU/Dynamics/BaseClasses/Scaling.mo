// generated from the table of fmu_build/core/blocks/dynamics/scaling.c by `make generate` - do not edit
within HystFMU.Dynamics.BaseClasses;
partial block Scaling "Limit, gain and offset of each signal: parameters and ports"
  extends Icons.Block;
  parameter Integer n(min = 1) = 1 "Number of signals" annotation (Dialog(group = "Sizes"));
  parameter Real gain[n] = fill(1.0, n) "Gain" annotation (Dialog(group = "Gains"));
  parameter Real offset[n] = fill(0.0, n) "Offset, added after the gain" annotation (Dialog(group = "Offset"));
  parameter Real lo[n](each min = -1e300, each max = 1e300) = fill(-1e+300, n) "Lower limit of the input (-1e300: none)" annotation (Dialog(group = "Limits"));
  parameter Real hi[n](each min = -1e300, each max = 1e300) = fill(1e+300, n) "Upper limit of the input (1e300: none)" annotation (Dialog(group = "Limits"));
  Interfaces.RealInput u[n] "Inputs" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y[n] "Limited, scaled and shifted inputs" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y_i = min(hi_i, max(lo_i, u_i)) gain_i + offset_i.</p>
<p><b>Source:</b> affine normalisation; limits of the training range.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Scaling\">Validation.Scaling</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.Scaling\">Dynamics.Scaling</a>.</p>
</html>"));
end Scaling;
