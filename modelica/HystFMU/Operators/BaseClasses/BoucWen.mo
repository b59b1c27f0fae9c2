// generated from the table of fmu_build/core/blocks/operators/bouc_wen.c by `make generate` - do not edit
within HystFMU.Operators.BaseClasses;
partial block BoucWen "Bouc-Wen operator: parameters and ports"
  extends Icons.Hysteresis;
  parameter Real A(min = 1e-100, max = 1e100) = 1 "Slope of z at z = 0" annotation (Dialog(group = "Operator"));
  parameter Real beta(min = 0, max = 1e100) = 0.5 "Width of the loop" annotation (Dialog(group = "Operator"));
  parameter Real gamma(min = -1e100, max = 1e100) = 0.5 "Shape of the loop; beta + gamma > 0" annotation (Dialog(group = "Operator"));
  parameter Real n(min = 1, max = 20) = 1 "Sharpness of the knee" annotation (Dialog(group = "Operator"));
  parameter Real alpha(min = 0, max = 1) = 0.5 "Weight of the linear term" annotation (Dialog(group = "Weights"));
  parameter Real k = 1 "Output gain" annotation (Dialog(group = "Gains"));
  parameter Real z0 = 0 "Z at u0; at most z_max in absolute value" annotation (Dialog(group = "Operator"));
  parameter Real u0 = 0 "Input that belongs to z0, before the first input" annotation (Dialog(group = "Start"));
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput du(unit = "1/s") if usesRate "Rate of u; Sampled has no such input" annotation (Placement(transformation(extent = {{-120, -80}, {-100, -60}})));
  Interfaces.RealOutput y "Output" annotation (Placement(transformation(extent = {{100, 30}, {120, 50}})));
  Interfaces.RealOutput z "Hysteretic part" annotation (Placement(transformation(extent = {{100, -50}, {120, -30}})));
protected
  constant Boolean usesRate = false "True if there is an input for the rate";
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> z' = A u' - beta |u'| |z|<sup>n-1</sup> z - gamma u' |z|<sup>n</sup>, y = k (alpha u + (1 - alpha) z).</p>
<p><b>Source:</b> Wen 1976; Ikhouane &amp; Rodellar 2007, ch. 2.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Sampled.BoucWen\">Validation.Sampled.BoucWen</a>.</p>
<p><b>Any realisation:</b> <code>replaceable Operators.Sampled.BoucWen hysteresis constrainedby Operators.BaseClasses.BoucWen;</code></p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.BoucWen\">Operators.Sampled.BoucWen</a>, <a href=\"modelica://HystFMU.Operators.Events.BoucWen\">Operators.Events.BoucWen</a>, <a href=\"modelica://HystFMU.Operators.Smooth.BoucWen\">Operators.Smooth.BoucWen</a>.</p>
</html>"));
end BoucWen;
