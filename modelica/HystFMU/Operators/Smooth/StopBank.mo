within HystFMU.Operators.Smooth;
block StopBank "Bank of stop operators, smooth"
  extends BaseClasses.StopBank(final usesRate = true);
  extends Interfaces.Rated;
  parameter Real width(min = 0) = 1e-3 "Input on which the corner of a play is rounded, greater than 0: the bound of the error of a play";
protected
  Real z[n] "Plays";
initial equation
  z = Functions.play(u, r, z0);
equation
  connect(du, rate);
  for i in 1:n loop
    der(z[i]) = Functions.playRate(u, rate, r[i], z[i], width);
  end for;
  s = fill(u, n) - z;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> s_i = u - z_i, z_i = max(u - r_i, min(u + r_i, z_i)).</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 3: play and stop add up to the input.</p>
<p><b>Limitations:</b> An ordinary differential equation without events, driven by the rate of the input; none. A play lags behind the exact one by at most width.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.StopBank\">Operators.Sampled.StopBank</a>, <a href=\"modelica://HystFMU.Operators.Events.StopBank\">Operators.Events.StopBank</a>, <a href=\"modelica://HystFMU.Validation.Smooth.StopBank\">Validation.Smooth.StopBank</a>.</p>
</html>"));
end StopBank;
