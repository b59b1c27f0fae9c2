// generated from the table of fmu_build/core/blocks/inverses/zhao_tan_inverse_reconstructed.c by `make generate` - do not edit
within HystFMU.Inverse.BaseClasses;
partial block ZhaoTanInverseReconstructed "Inverse Zhao-Tan operator, reconstructed from the paper: parameters and ports"
  extends Icons.Inverse;
  parameter Integer depth(min = 4) = 16 "Maximum number of stored extrema" annotation (Dialog(group = "Memory"));
  parameter Real x0 = 0 "Initial memory: the operator rests at x = x0, h = 0" annotation (Dialog(group = "Start"));
  Interfaces.RealInput h "Wanted output of the operator" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput dh(unit = "1/s") if usesRate "Rate of h; Sampled has no such input" annotation (Placement(transformation(extent = {{-120, -80}, {-100, -60}})));
  Interfaces.RealOutput x "Approximate operator input, for an inverse network" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  constant Boolean usesRate = false "True if there is an input for the rate";
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> x = x_p + sgn(h - h_p) (1 + e<sup>-d</sup>) d, d = |h - h_p|; virgin branch by Masing.</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, eq. 11 (lost; reconstructed).</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Sampled.ZhaoTanInverseReconstructed\">Validation.Sampled.ZhaoTanInverseReconstructed</a>.</p>
<p><b>Any realisation:</b> <code>replaceable Inverse.Sampled.ZhaoTanInverseReconstructed inverse constrainedby Inverse.BaseClasses.ZhaoTanInverseReconstructed;</code></p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Sampled.ZhaoTanInverseReconstructed\">Inverse.Sampled.ZhaoTanInverseReconstructed</a>, <a href=\"modelica://HystFMU.Inverse.Events.ZhaoTanInverseReconstructed\">Inverse.Events.ZhaoTanInverseReconstructed</a>.</p>
</html>"));
end ZhaoTanInverseReconstructed;
