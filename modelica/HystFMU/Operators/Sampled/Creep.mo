within HystFMU.Operators.Sampled;
block Creep "Weighted sum of first-order lags, sampled"
  extends BaseClasses.Creep(y(start = 0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real q[n](each start = 0, each fixed = true) "Lagged inputs";
equation
  when sample(0, Ts) then
    q = if time < 0.5*Ts then (if start == Types.Start.steady then fill(u, n) else zeros(n)) else Functions.lag(u, T, Ts, pre(q));
    y = w*q;
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> q_i' = (u - q_i)/T_i, y = sum_i w_i q_i.</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001: creep as a few lags.</p>
<p><b>Limitations:</b> Acts at 0, Ts, 2 Ts, ...: the unit of the same name stepped with Ts; extrema between two samples are not seen; linear: the creep of an actuator follows its hysteresis. The simulation must start at time 0.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.RateDependence\">Examples.RateDependence</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Smooth.Creep\">Operators.Smooth.Creep</a>, <a href=\"modelica://HystFMU.Validation.Sampled.Creep\">Validation.Sampled.Creep</a>.</p>
</html>"));
end Creep;
