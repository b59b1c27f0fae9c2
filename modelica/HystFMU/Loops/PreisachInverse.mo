within HystFMU.Loops;
block PreisachInverse "Inverse of a Preisach operator by root finding"
  extends Interfaces.Inverse;
  parameter Integer n(min = 1) = 4 "Number of grid steps over [lo, hi]" annotation (Dialog(group = "Sizes"));
  parameter Integer depth(min = 4) = 16 "Maximum number of stored extrema" annotation (Dialog(group = "Memory"));
  parameter Real lo = -2 "Input of negative saturation" annotation (Dialog(group = "Limits"));
  parameter Real hi = 2 "Input of positive saturation" annotation (Dialog(group = "Limits"));
  parameter Real E[div(n*(n + 1), 2)] = {0.65, 1.4, 0.65, 2.25, 1.4, 0.65, 3.2, 2.25, 1.4, 0.65} "Everett function" annotation (Dialog(group = "Parameters"));
  parameter Types.Time Ts = 1e-4 "Sample period" annotation (Dialog(group = "Sampling"));
  Inverse.Sampled.ImplicitInverse root(redeclare package Model = Inverse.Models.Preisach, lo = lo, hi = hi, values = cat(1, {lo, hi, origin}, virgin, E), state0 = cat(1, {0, 0, 0, origin}, zeros(2*depth)), Ts = Ts) annotation (Placement(transformation(extent = {{-10, -10}, {10, 10}})));
protected
  parameter Real origin = 0.5*lo + 0.5*hi "Input at the start of the first branch";
  parameter Real virgin[2*n + 1] = Functions.demagnetisedBranch(n, E, 0) "First branch from the demagnetised state";
equation
  connect(y, root.y) annotation (Line(points = {{-110, 0}, {-11, 0}}, color = {0, 0, 127}));
  connect(root.u, u) annotation (Line(points = {{11, 0}, {110, 0}}, color = {0, 0, 127}));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> solves H[u] = y for u, with H as in Operators.BaseClasses.Preisach.</p>
<p><b>Source:</b> Mayergoyz 1991.</p>
<p><b>Limitations:</b> the initial state is demagnetised, with output 0; y must lie between the two saturated outputs.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.Preisach\">Examples.Preisach</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Sampled.ImplicitInverse\">Inverse.Sampled.ImplicitInverse</a>, <a href=\"modelica://HystFMU.Loops.PreisachPlant\">Loops.PreisachPlant</a>.</p>
</html>"));
end PreisachInverse;
