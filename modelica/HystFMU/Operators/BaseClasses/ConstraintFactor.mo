// generated from the table of fmu_build/core/blocks/operators/constraint_factor.c by `make generate` - do not edit
within HystFMU.Operators.BaseClasses;
partial block ConstraintFactor "Constraint-factor operator (Ma): odd polynomial branch: parameters and ports"
  extends Icons.Hysteresis;
  parameter Integer m(min = 1) = 1 "Number of odd powers" annotation (Dialog(group = "Sizes"));
  parameter Integer depth(min = 4) = 16 "Maximum number of stored extrema" annotation (Dialog(group = "Memory"));
  parameter Real a0 = 0 "Constant of the polynomial: slope at the branch start" annotation (Dialog(group = "Operator"));
  parameter Real a[m] = fill(1.0, m) "Coefficients of d, d^3, .., d^(2m-1)" annotation (Dialog(group = "Weights"));
  parameter Real d_max(min = 0) = 10 "Longest branch of the polynomial, then a straight line; a virgin branch counts double; greater than 0" annotation (Dialog(group = "Limits"));
  parameter Types.Memory memory = Types.Memory.dominant "Extremum at which a branch starts" annotation (Dialog(group = "Memory"));
  parameter Real x0 = 0 "Initial memory: the operator rests at x = x0, h = 0" annotation (Dialog(group = "Start"));
  Interfaces.RealInput x "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput dx(unit = "1/s") if usesRate "Rate of x; Sampled has no such input" annotation (Placement(transformation(extent = {{-120, -80}, {-100, -60}})));
  Interfaces.RealOutput h "Output of the operator" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  constant Boolean usesRate = false "True if there is an input for the rate";
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> h = h_p + sgn(x - x_p) (1 - e<sup>-d</sup>) (a0 + sum_j a_j d<sup>2j-1</sup>), d = |x - x_p|; virgin branch by Masing.</p>
<p><b>Source:</b> Shen &amp; Ma 2017, eq. 1-2, with return-point memory.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Sampled.ConstraintFactor\">Validation.Sampled.ConstraintFactor</a>.</p>
<p><b>Any realisation:</b> <code>replaceable Operators.Sampled.ConstraintFactor hysteresis constrainedby Operators.BaseClasses.ConstraintFactor;</code></p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.ConstraintFactor\">Operators.Sampled.ConstraintFactor</a>, <a href=\"modelica://HystFMU.Operators.Events.ConstraintFactor\">Operators.Events.ConstraintFactor</a>, <a href=\"modelica://HystFMU.Operators.Smooth.ConstraintFactor\">Operators.Smooth.ConstraintFactor</a>.</p>
</html>"));
end ConstraintFactor;
