within HystFMU.Operators.Smooth;
block Creep "Weighted sum of the input and its first-order lags, smooth"
  extends BaseClasses.Creep;
  extends Interfaces.InChain;
  Real q[n] "Lagged inputs";
protected
  Real d[n] "Lagged inputs minus their initial values";
initial equation
  if start == Types.Start.steady and not inChain then
    q = fill(u, n);
  else
    d = zeros(n);
  end if;
equation
  first = if start == Types.Start.steady then u else 0;
  for i in 1:n loop
    q[i] = if inChain then taken + d[i] else d[i];
    T[i]*der(d[i]) = u - q[i];
  end for;
  y = w0*u + w*q;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> linear; in an actuator, the creep follows the hysteresis.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.Creep\">Operators.BaseClasses.Creep</a>: equation, source, example.</p>
</html>"));
end Creep;
