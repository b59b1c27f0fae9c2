within HystFMU.Examples;
model ImplicitInverse "Inverse by root finding of an operator that has no inverse in closed form"
  extends Icons.Example;
  parameter Types.Time Ts = 2e-3 "Sample period" annotation (Dialog(group = "Sampling"));
  parameter Real E[6] = {0.5, 0.9, 0.4, 1.4, 1.1, 0.6} "Everett function on a grid of three steps" annotation (Dialog(group = "Parameters"));
  Sources.Multisine wanted(m = 2, f = {4, 18}, a = {0.5, 0.3}, ph = {0, 0}) annotation (Placement(transformation(extent = {{-60, -10}, {-40, 10}})));
  Inverse.Sampled.ImplicitInverse inverse(redeclare package Model = Inverse.Models.Preisach, lo = -1, hi = 1, values = cat(1, {-1, 1, 0}, virgin, E), state0 = zeros(4 + 2*8), Ts = Ts) annotation (Placement(transformation(extent = {{-20, -10}, {0, 10}})));
  Operators.Sampled.Preisach hysteresis(n = 3, depth = 8, lo = -1, hi = 1, E = E, Ts = Ts) annotation (Placement(transformation(extent = {{20, -10}, {40, 10}})));
protected
  parameter Real virgin[7] = Functions.demagnetisedBranch(3, E, 0) "First branch from the demagnetised state";
equation
  connect(wanted.r, inverse.y) annotation (Line(points = {{-39, 6}, {-30, 6}, {-30, 0}, {-21, 0}}, color = {0, 0, 127}));
  connect(inverse.u, hysteresis.u) annotation (Line(points = {{1, 0}, {19, 0}}, color = {0, 0, 127}));
  annotation (experiment(StopTime = 0.25, Interval = 0.002, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>hysteresis.y equals wanted.r at every sample. The inverse evaluates a copy of the operator for trial inputs, and then
steps the copy with the root. Redeclare Model to change the operator.</p>
<p><b>Source:</b> Preisach operator: Mayergoyz 1991; root finding: Chandrupatla 1997.</p>
<p><b>Limitations:</b> static models only; the wanted output must be within the range of the model.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Sampled.ImplicitInverse\">Inverse.Sampled.ImplicitInverse</a>, <a href=\"modelica://HystFMU.Inverse.Models\">Inverse.Models</a>.</p>
</html>"));
end ImplicitInverse;
