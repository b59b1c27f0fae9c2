// generated from the table of fmu_build/core/blocks/operators/duhem.c by `make generate` - do not edit
within HystFMU.Operators.BaseClasses;
partial block Duhem "Duhem operator with slopes for rising and falling input: parameters and ports"
  extends Icons.Hysteresis;
  parameter Integer m(min = 0) = 0 "Number of B-splines of the input u, less 1" annotation (Dialog(group = "Sizes"));
  parameter Integer q(min = 1) = 1 "Degree in the state w" annotation (Dialog(group = "Sizes"));
  parameter Real k = 0.5 "Slope of the linear term" annotation (Dialog(group = "Operator"));
  parameter Real a_rise[m + 1] = fill(0.5, m + 1) "Rising u: weights of B_i(u)" annotation (Dialog(group = "Weights"));
  parameter Real b_rise[(m + 1)*q] = fill(-0.5, (m + 1)*q) "Rising u: weights of B_i w^j, one row per i" annotation (Dialog(group = "Weights"));
  parameter Real c_rise[(m + 1)*q] = fill(-0.5, (m + 1)*q) "Rising u: weights of B_i |w| w^(j-1)" annotation (Dialog(group = "Weights"));
  parameter Real a_fall[m + 1] = fill(0.5, m + 1) "Falling u: weights of B_i(u)" annotation (Dialog(group = "Weights"));
  parameter Real b_fall[(m + 1)*q] = fill(0.5, (m + 1)*q) "Falling u: weights of B_i w^j, one row per i" annotation (Dialog(group = "Weights"));
  parameter Real c_fall[(m + 1)*q] = fill(-0.5, (m + 1)*q) "Falling u: weights of B_i |w| w^(j-1)" annotation (Dialog(group = "Weights"));
  parameter Real w_max(min = 0, max = 1e100) = 1e100 "Bound of |w|; greater than 0" annotation (Dialog(group = "Limits"));
  parameter Real du_max(min = 0) = 0.02 "Longest integration step in u; greater than 0" annotation (Dialog(group = "Limits"));
  parameter Real w0 = 0 "W at u0" annotation (Dialog(group = "Operator"));
  parameter Real u0 = 0 "Input that belongs to w0, before the first input" annotation (Dialog(group = "Start"));
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput du(unit = "1/s") if usesRate "Rate of u; Sampled has no such input" annotation (Placement(transformation(extent = {{-120, -80}, {-100, -60}})));
  Interfaces.RealOutput y "Output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  constant Boolean usesRate = false "True if there is an input for the rate";
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> dw/du = sum_i B_i(u) (a_i + sum_j (b_ij w<sup>j</sup> + c_ij |w| w<sup>j-1</sup>)), y = k u + w.</p>
<p><b>Source:</b> Oh &amp; Bernstein 2005; Coleman &amp; Hodgdon 1986 (Duhem's form).</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Sampled.Duhem\">Validation.Sampled.Duhem</a>.</p>
<p><b>Any realisation:</b> <code>replaceable Operators.Sampled.Duhem hysteresis constrainedby Operators.BaseClasses.Duhem;</code></p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.Duhem\">Operators.Sampled.Duhem</a>, <a href=\"modelica://HystFMU.Operators.Smooth.Duhem\">Operators.Smooth.Duhem</a>.</p>
</html>"));
end Duhem;
