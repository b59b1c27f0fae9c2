// generated from the table of fmu_build/core/blocks/operators/zhao_tan.c by `make generate` - do not edit
within HystFMU.Operators.BaseClasses;
partial block ZhaoTan "Zhao-Tan hysteretic operator: parameters and ports"
  extends Icons.Hysteresis;
  parameter Integer depth(min = 4) = 16 "Maximum number of stored extrema" annotation (Dialog(group = "Memory"));
  parameter Types.Memory memory = Types.Memory.dominant "Extremum at which a branch starts" annotation (Dialog(group = "Memory"));
  parameter Real x0 = 0 "Initial memory: the operator rests at x = x0, h = 0" annotation (Dialog(group = "Start"));
  Interfaces.RealInput x "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput dx(unit = "1/s") if usesRate "Rate of x; Sampled has no such input" annotation (Placement(transformation(extent = {{-120, -80}, {-100, -60}})));
  Interfaces.RealOutput h "Output of the operator" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  constant Boolean usesRate = false "True if there is an input for the rate";
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> h = h_p + sgn(x - x_p) (1 - e<sup>-d</sup>) d, d = |x - x_p|; virgin branch h = sgn(x - x0) g(2|x - x0|)/2.</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, eq. 1.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Sampled.ZhaoTan\">Validation.Sampled.ZhaoTan</a>.</p>
<p><b>Any realisation:</b> <code>replaceable Operators.Sampled.ZhaoTan hysteresis constrainedby Operators.BaseClasses.ZhaoTan;</code></p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.ZhaoTan\">Operators.Sampled.ZhaoTan</a>, <a href=\"modelica://HystFMU.Operators.Events.ZhaoTan\">Operators.Events.ZhaoTan</a>, <a href=\"modelica://HystFMU.Operators.Smooth.ZhaoTan\">Operators.Smooth.ZhaoTan</a>.</p>
</html>"));
end ZhaoTan;
