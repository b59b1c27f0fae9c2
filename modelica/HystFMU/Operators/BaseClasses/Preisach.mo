// generated from the table of fmu_build/core/blocks/operators/preisach.c by `make generate` - do not edit
within HystFMU.Operators.BaseClasses;
partial block Preisach "Preisach operator in Everett's form: parameters and ports"
  extends Icons.Hysteresis;
  parameter Integer n(min = 1) = 2 "Number of grid steps over [lo, hi]" annotation (Dialog(group = "Sizes"));
  parameter Integer depth(min = 4) = 16 "Maximum number of stored extrema" annotation (Dialog(group = "Memory"));
  parameter Real lo = -4 "Input of negative saturation" annotation (Dialog(group = "Limits"));
  parameter Real hi = 4 "Input of positive saturation" annotation (Dialog(group = "Limits"));
  parameter Real E[div(n*(n + 1), 2)] = fill(1.0, div(n*(n + 1), 2)) "Everett function at (alpha_1, beta_0), (alpha_2, beta_0), (alpha_2, beta_1), .., (alpha_n, beta_(n-1))" annotation (Dialog(group = "Operator"));
  parameter Real offset = 0 "Mean of the two saturated outputs" annotation (Dialog(group = "Offset"));
  parameter Types.Magnetisation start = Types.Magnetisation.demagnetised "Initial memory" annotation (Dialog(group = "Start"));
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput du(unit = "1/s") if usesRate "Rate of u; Sampled has no such input" annotation (Placement(transformation(extent = {{-120, -80}, {-100, -60}})));
  Interfaces.RealOutput y "Output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  constant Boolean usesRate = false "True if there is an input for the rate";
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = y_p - 2 E(u_p, u) falling, y_p + 2 E(u, u_p) rising, E linear between its grid values.</p>
<p><b>Source:</b> Mayergoyz, Mathematical Models of Hysteresis 1991, ch. 1; Everett 1955.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.ImplicitInverse\">Examples.ImplicitInverse</a>.</p>
<p><b>Any realisation:</b> <code>replaceable Operators.Sampled.Preisach hysteresis constrainedby Operators.BaseClasses.Preisach;</code></p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.Preisach\">Operators.Sampled.Preisach</a>, <a href=\"modelica://HystFMU.Operators.Events.Preisach\">Operators.Events.Preisach</a>, <a href=\"modelica://HystFMU.Validation.Sampled.Preisach\">Validation.Sampled.Preisach</a>.</p>
</html>"));
end Preisach;
