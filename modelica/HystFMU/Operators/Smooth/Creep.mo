within HystFMU.Operators.Smooth;
block Creep "Weighted sum of first-order lags, smooth"
  extends BaseClasses.Creep;
  extends Icons.Smooth;
  Real q[n] "Lagged inputs";
initial equation
  if start == Types.Start.steady then
    der(q) = zeros(n);
  else
    q = zeros(n);
  end if;
equation
  for i in 1:n loop
    T[i]*der(q[i]) = u - q[i];
  end for;
  y = w*q;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> q_i' = (u - q_i)/T_i, y = sum_i w_i q_i.</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001: creep as a few lags.</p>
<p><b>Limitations:</b> An ordinary differential equation without events, driven by the rate of the input; linear: the creep of an actuator follows its hysteresis.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.RateDependence\">Examples.RateDependence</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.Creep\">Operators.Sampled.Creep</a>, <a href=\"modelica://HystFMU.Validation.Smooth.Creep\">Validation.Smooth.Creep</a>.</p>
</html>"));
end Creep;
