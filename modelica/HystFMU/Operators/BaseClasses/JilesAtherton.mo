// generated from the table of fmu_build/core/blocks/operators/jiles_atherton.c by `make generate` - do not edit
within HystFMU.Operators.BaseClasses;
partial block JilesAtherton "Jiles-Atherton operator: parameters and ports"
  extends Icons.Hysteresis;
  parameter Integer steps(min = 1) = 4 "Integration steps per field of length min(a, k)" annotation (Dialog(group = "Sizes"));
  parameter Real Ms(min = 1e-100, max = 1e100) = 1 "Saturation of y" annotation (Dialog(group = "Operator"));
  parameter Real a(min = 1e-100, max = 1e100) = 0.3 "Shape of the anhysteretic curve: its slope at 0 is Ms / (3 a)" annotation (Dialog(group = "Operator"));
  parameter Real k(min = 1e-100, max = 1e100) = 0.25 "Pinning of the domain walls, approximately the coercive field" annotation (Dialog(group = "Operator"));
  parameter Real c(min = 0, max = 1) = 0.1 "Reversible share" annotation (Dialog(group = "Operator"));
  parameter Real alpha(min = -1e100, max = 1e100) = 0.05 "Mean field at y = 1; alpha Ms < 3 a" annotation (Dialog(group = "Operator"));
  parameter Real m0 = 0 "Irreversible part of y at u0" annotation (Dialog(group = "Operator"));
  parameter Real u0 = 0 "Field that belongs to m0, before the first input" annotation (Dialog(group = "Start"));
  Interfaces.RealInput u "Field" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput du(unit = "1/s") if usesRate "Rate of u; Sampled has no such input" annotation (Placement(transformation(extent = {{-120, -80}, {-100, -60}})));
  Interfaces.RealOutput y "Magnetisation" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  constant Boolean usesRate = false "True if there is an input for the rate";
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = (1 - c) m + c f(h), dm/dh = max(0, s (f(h) - m)) / k, h = u + alpha y, f(h) = Ms (coth(h/a) - a/h), s = sgn(u').</p>
<p><b>Source:</b> Jiles &amp; Atherton 1986; Sadowski et al. 2002.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Sampled.JilesAtherton\">Validation.Sampled.JilesAtherton</a>.</p>
<p><b>Any realisation:</b> <code>replaceable Operators.Sampled.JilesAtherton hysteresis constrainedby Operators.BaseClasses.JilesAtherton;</code></p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.JilesAtherton\">Operators.Sampled.JilesAtherton</a>, <a href=\"modelica://HystFMU.Operators.Smooth.JilesAtherton\">Operators.Smooth.JilesAtherton</a>.</p>
</html>"));
end JilesAtherton;
