// generated from the table of fmu_build/core/blocks/inverses/constraint_factor_inverse.c by `make generate` - do not edit
within HystFMU.Inverse.BaseClasses;
partial block ConstraintFactorInverse "Exact inverse of the constraint-factor operator: parameters and ports"
  extends Icons.Inverse;
  parameter Integer m(min = 1) = 1 "Number of odd powers" annotation (Dialog(group = "Sizes"));
  parameter Integer depth(min = 4) = 16 "Maximum number of stored extrema" annotation (Dialog(group = "Memory"));
  parameter Real a0 = 0 "Constant of the polynomial: slope at the branch start" annotation (Dialog(group = "Operator"));
  parameter Real a[m] = fill(1.0, m) "Coefficients of d, d^3, .., d^(2m-1)" annotation (Dialog(group = "Weights"));
  parameter Real d_max(min = 0) = 10 "Longest branch of the polynomial, then a straight line; a virgin branch counts double; greater than 0" annotation (Dialog(group = "Limits"));
  parameter Real x0 = 0 "Initial memory: the operator rests at x = x0, h = 0" annotation (Dialog(group = "Start"));
  Interfaces.RealInput h "Wanted output of the operator" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput dh(unit = "1/s") if usesRate "Rate of h; Sampled has no such input" annotation (Placement(transformation(extent = {{-120, -80}, {-100, -60}})));
  Interfaces.RealOutput x "Operator input for the output h" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  constant Boolean usesRate = false "True if there is an input for the rate";
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> x = x_p + sgn(h - h_p) g<sup>-1</sup>(|h - h_p|), g(d) = (1 - e<sup>-d</sup>) (a0 + sum_j a_j d<sup>2j-1</sup>).</p>
<p><b>Source:</b> Shen &amp; Ma 2017, eq. 1-2, solved for x; inverse by the same memory: Krejci &amp; Kuhnen 2001.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Sampled.ConstraintFactorInverse\">Validation.Sampled.ConstraintFactorInverse</a>.</p>
<p><b>Any realisation:</b> <code>replaceable Inverse.Sampled.ConstraintFactorInverse inverse constrainedby Inverse.BaseClasses.ConstraintFactorInverse;</code></p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Sampled.ConstraintFactorInverse\">Inverse.Sampled.ConstraintFactorInverse</a>, <a href=\"modelica://HystFMU.Inverse.Events.ConstraintFactorInverse\">Inverse.Events.ConstraintFactorInverse</a>.</p>
</html>"));
end ConstraintFactorInverse;
