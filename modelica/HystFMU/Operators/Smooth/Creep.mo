within HystFMU.Operators.Smooth;
block Creep "Weighted sum of the input and its first-order lags, smooth"
  extends BaseClasses.Creep;
  extends Icons.Smooth;
  Real q[n] "Lagged inputs";
initial equation
  if start == Types.Start.steady then
    q = fill(u, n);
  else
    q = zeros(n);
  end if;
equation
  for i in 1:n loop
    T[i]*der(q[i]) = u - q[i];
  end for;
  y = w0*u + w*q;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> linear: the creep of an actuator follows its hysteresis.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.Creep\">Operators.BaseClasses.Creep</a>: equation, source, example.</p>
</html>"));
end Creep;
