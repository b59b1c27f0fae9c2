within HystFMU.Operators;
block DeadZones "Weighted sum of one-sided dead zones"
  extends Icons.Block;
  parameter Integer n(min = 1) = 6 "Number of dead zones";
  parameter Real w0 = 1 "Weight of the linear term";
  parameter Real r[n] = fill(0.1, n) "Thresholds; the sign is the side";
  parameter Real w[n] = fill(0.1, n) "Weights of the dead zones";
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y "Output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
equation
  y = w0*u + w*Functions.deadZone(u, r);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = w0 u + sum_i w_i S(u, r_i); S = max(u - r, 0) for r &gt; 0, min(u - r, 0) for r &lt; 0, u for r = 0.</p>
<p><b>Source:</b> Kuhnen, European Journal of Control 9 (2003) 407-418.</p>
<p><b>Limitations:</b> memoryless: it follows a sum of plays, which it makes asymmetric.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.DeadZones\">Validation.DeadZones</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.PrandtlIshlinskii\">Operators.Sampled.PrandtlIshlinskii</a>.</p>
</html>"));
end DeadZones;
