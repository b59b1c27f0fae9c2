within HystFMU.Operators.Sampled;
block Creep "Weighted sum of the input and its first-order lags, sampled"
  extends BaseClasses.Creep(y(start = 0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real q[n](each start = 0, each fixed = true) "Lagged inputs";
equation
  when sample(t0, Ts) then
    q = if not pre(begun) then (if start == Types.Start.steady then fill(u, n) else zeros(n)) else Functions.lag(u, T, Ts, pre(q));
    y = w0*u + w*q;
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> linear; in an actuator, the creep follows the hysteresis.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.Creep\">Operators.BaseClasses.Creep</a>: equation, source, example.</p>
</html>"));
end Creep;
