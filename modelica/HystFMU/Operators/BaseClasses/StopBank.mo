within HystFMU.Operators.BaseClasses;
partial block StopBank "Bank of stop operators: parameters and ports"
  extends Icons.Hysteresis;
  parameter Integer n(min = 1) = 10 "Number of stops" annotation (Dialog(group = "Parameters"));
  parameter Real r[n](each min = 0) = fill(0.1, n) "Half-widths of the stops" annotation (Dialog(group = "Parameters"));
  parameter Real z0[n] = fill(0.0, n) "Initial states of the plays, whose differences from u are the stops" annotation (Dialog(group = "Parameters"));
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput du(unit = "1/s") if usesRate "Rate of u; the realisation Sampled has no such input" annotation (Placement(transformation(extent = {{-120, -80}, {-100, -60}})));
  Interfaces.RealOutput s[n] "Outputs of the stops, between -r_i and r_i" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  constant Boolean usesRate = false "True if there is an input for the rate";
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> s_i = u - z_i, z_i = max(u - r_i, min(u + r_i, z_i)).</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 3: play and stop add up to the input.</p>
<p><b>Limitations:</b> partial class of all realisations; replaceable components use it as constraining class.</p>
<p><b>Example:</b> <code>replaceable Operators.Sampled.StopBank hysteresis constrainedby Operators.BaseClasses.StopBank;</code></p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.StopBank\">Operators.Sampled.StopBank</a>, <a href=\"modelica://HystFMU.Operators.Events.StopBank\">Operators.Events.StopBank</a>, <a href=\"modelica://HystFMU.Operators.Smooth.StopBank\">Operators.Smooth.StopBank</a>.</p>
</html>"));
end StopBank;
