// generated from the table of fmu_build/core/blocks/operators/play_bank.c by `make generate` - do not edit
within HystFMU.Operators.BaseClasses;
partial block PlayBank "Bank of play (backlash) operators: parameters and ports"
  extends Icons.Hysteresis;
  parameter Integer n(min = 1) = 10 "Number of plays" annotation (Dialog(group = "Sizes"));
  parameter Real r[n](each min = 0) = fill(0.1, n) "Half-widths of the plays" annotation (Dialog(group = "Thresholds"));
  parameter Real z0[n] = fill(0.0, n) "Initial play states" annotation (Dialog(group = "Start"));
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput du(unit = "1/s") if usesRate "Rate of u; Sampled has no such input" annotation (Placement(transformation(extent = {{-120, -80}, {-100, -60}})));
  Interfaces.RealOutput z[n] "Outputs of the plays" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  constant Boolean usesRate = false "True if there is an input for the rate";
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> z_i = max(u - r_i, min(u + r_i, z_i)).</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 3.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Sampled.PlayBank\">Validation.Sampled.PlayBank</a>.</p>
<p><b>Any realisation:</b> <code>replaceable Operators.Sampled.PlayBank hysteresis constrainedby Operators.BaseClasses.PlayBank;</code></p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.PlayBank\">Operators.Sampled.PlayBank</a>, <a href=\"modelica://HystFMU.Operators.Events.PlayBank\">Operators.Events.PlayBank</a>, <a href=\"modelica://HystFMU.Operators.Smooth.PlayBank\">Operators.Smooth.PlayBank</a>.</p>
</html>"));
end PlayBank;
