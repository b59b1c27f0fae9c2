within HystFMU.Dynamics;
block RateFilter "Lag with a signal and its rate as outputs, for operators that need both"
  extends Icons.Block;
  parameter Types.Time T(min = 1e-12) = 1e-3 "Time constant of the lag" annotation (Dialog(group = "Parameters"));
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput r(start = 0, fixed = true) "Lagged input" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  Interfaces.RealOutput dr(unit = "1/s") "Rate of r" annotation (Placement(transformation(extent = {{100, -80}, {120, -60}})));
equation
  der(r) = dr;
  T*dr = u - r;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> T r' = u - r, dr = r'.</p>
<p><b>Source:</b> the rate of a state is known without differentiation.</p>
<p><b>Limitations:</b> the input of the operator lags by T; the initial output is 0.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.RateFilter\">Validation.RateFilter</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Interfaces.Reversals\">Interfaces.Reversals</a>, <a href=\"modelica://HystFMU.Dynamics.Differentiator\">Dynamics.Differentiator</a>.</p>
</html>"));
end RateFilter;
