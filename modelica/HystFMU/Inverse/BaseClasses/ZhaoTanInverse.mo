// generated from the table of fmu_build/core/blocks/inverses/zhao_tan_inverse.c by `make generate` - do not edit
within HystFMU.Inverse.BaseClasses;
partial block ZhaoTanInverse "Exact inverse of the Zhao-Tan operator: parameters and ports"
  extends Icons.Inverse;
  parameter Integer depth(min = 4) = 16 "Maximum number of stored extrema" annotation (Dialog(group = "Memory"));
  parameter Real x0 = 0 "Initial memory: the operator rests at x = x0, h = 0" annotation (Dialog(group = "Start"));
  Interfaces.RealInput h "Wanted output of the operator" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput dh(unit = "1/s") if usesRate "Rate of h; Sampled has no such input" annotation (Placement(transformation(extent = {{-120, -80}, {-100, -60}})));
  Interfaces.RealOutput x "Operator input for the output h" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  constant Boolean usesRate = false "True if there is an input for the rate";
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> x = x_p + sgn(h - h_p) g<sup>-1</sup>(|h - h_p|), g(d) = (1 - e<sup>-d</sup>) d.</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, eq. 1, solved for x; inverse by the same memory: Krejci &amp; Kuhnen 2001.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Sampled.ZhaoTanInverse\">Validation.Sampled.ZhaoTanInverse</a>.</p>
<p><b>Any realisation:</b> <code>replaceable Inverse.Sampled.ZhaoTanInverse inverse constrainedby Inverse.BaseClasses.ZhaoTanInverse;</code></p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Sampled.ZhaoTanInverse\">Inverse.Sampled.ZhaoTanInverse</a>, <a href=\"modelica://HystFMU.Inverse.Events.ZhaoTanInverse\">Inverse.Events.ZhaoTanInverse</a>.</p>
</html>"));
end ZhaoTanInverse;
