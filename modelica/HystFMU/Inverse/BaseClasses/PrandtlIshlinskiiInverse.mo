within HystFMU.Inverse.BaseClasses;
partial block PrandtlIshlinskiiInverse "Exact inverse of the Prandtl-Ishlinskii operator: parameters and ports"
  extends Icons.Inverse;
  parameter Integer n(min = 1) = 10 "Number of play operators";
  parameter Integer depth(min = 4) = 256 "Extrema that the memory holds";
  parameter Real w0(min = 0) = 1 "Weight of the linear term, greater than 0";
  parameter Real r[n](each min = 0) = fill(0.1, n) "Thresholds (play half-widths), not decreasing";
  parameter Real w[n] = fill(0.1, n) "Weights of the plays";
  parameter Real u0 = 0 "Initial memory: every play rests at this value of u";
  Interfaces.RealInput y "Wanted output of the operator" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput dy(unit = "1/s") if usesRate "Rate of y; Sampled has no such input" annotation (Placement(transformation(extent = {{-120, -80}, {-100, -60}})));
  Interfaces.RealOutput u "Input of the operator that gives y" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  constant Boolean usesRate = false "Is there an input for the rate?";
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> u such that w0 u + sum_i w_i p_{r_i}[u] = y.</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 10-14.</p>
<p><b>Limitations:</b> what the realisations have in common, for replaceable components to be constrained by.</p>
<p><b>Example:</b> <code>replaceable Inverse.Sampled.PrandtlIshlinskiiInverse inverse constrainedby Inverse.BaseClasses.PrandtlIshlinskiiInverse;</code></p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Sampled.PrandtlIshlinskiiInverse\">Inverse.Sampled.PrandtlIshlinskiiInverse</a>, <a href=\"modelica://HystFMU.Inverse.Events.PrandtlIshlinskiiInverse\">Inverse.Events.PrandtlIshlinskiiInverse</a>.</p>
</html>"));
end PrandtlIshlinskiiInverse;
