// generated from the table of fmu_build/core/blocks/operators/coleman_hodgdon.c by `make generate` - do not edit
within HystFMU.Operators.BaseClasses;
partial block ColemanHodgdon "Coleman-Hodgdon operator: parameters and ports"
  extends Icons.Hysteresis;
  parameter Real alpha(min = 1e-100, max = 1e100) = 1 "Rate of the exponential, in 1 / input" annotation (Dialog(group = "Operator"));
  parameter Real b = 1 "Slope of the line y = b u" annotation (Dialog(group = "Operator"));
  parameter Real k = 0.6 "Slope of y on the line y = b u" annotation (Dialog(group = "Operator"));
  parameter Real y0 = 0 "Output at u0" annotation (Dialog(group = "Operator"));
  parameter Real u0 = 0 "Input that belongs to y0, before the first input" annotation (Dialog(group = "Start"));
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput du(unit = "1/s") if usesRate "Rate of u; Sampled has no such input" annotation (Placement(transformation(extent = {{-120, -80}, {-100, -60}})));
  Interfaces.RealOutput y "Output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  constant Boolean usesRate = false "True if there is an input for the rate";
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y' = alpha |u'| (b u - y) + k u'.</p>
<p><b>Source:</b> Coleman &amp; Hodgdon 1986, with f(u) = b u and g(u) = k.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Sampled.ColemanHodgdon\">Validation.Sampled.ColemanHodgdon</a>.</p>
<p><b>Any realisation:</b> <code>replaceable Operators.Sampled.ColemanHodgdon hysteresis constrainedby Operators.BaseClasses.ColemanHodgdon;</code></p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.ColemanHodgdon\">Operators.Sampled.ColemanHodgdon</a>, <a href=\"modelica://HystFMU.Operators.Events.ColemanHodgdon\">Operators.Events.ColemanHodgdon</a>, <a href=\"modelica://HystFMU.Operators.Smooth.ColemanHodgdon\">Operators.Smooth.ColemanHodgdon</a>.</p>
</html>"));
end ColemanHodgdon;
