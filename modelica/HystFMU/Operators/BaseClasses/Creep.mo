within HystFMU.Operators.BaseClasses;
partial block Creep "Weighted sum of first-order lags: parameters and ports"
  extends Icons.Hysteresis;
  parameter Integer n(min = 1) = 1 "Number of lags";
  parameter Real w[n] = fill(1.0, n) "Weights of the lags";
  parameter Types.Time T[n](each min = 0) = fill(1.0, n) "Time constants, greater than 0";
  parameter Types.Start start = Types.Start.rest "Lags begin at 0, or at the first input";
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput du(unit = "1/s") if usesRate "Rate of u; Sampled has no such input" annotation (Placement(transformation(extent = {{-120, -80}, {-100, -60}})));
  Interfaces.RealOutput y "Output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  constant Boolean usesRate = false "Is there an input for the rate?";
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> q_i' = (u - q_i)/T_i, y = sum_i w_i q_i.</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001: creep as a few lags.</p>
<p><b>Limitations:</b> what the realisations have in common, for replaceable components to be constrained by.</p>
<p><b>Example:</b> <code>replaceable Operators.Sampled.Creep hysteresis constrainedby Operators.BaseClasses.Creep;</code></p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.Creep\">Operators.Sampled.Creep</a>, <a href=\"modelica://HystFMU.Operators.Smooth.Creep\">Operators.Smooth.Creep</a>.</p>
</html>"));
end Creep;
