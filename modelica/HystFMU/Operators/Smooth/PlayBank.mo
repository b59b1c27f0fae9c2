within HystFMU.Operators.Smooth;
block PlayBank "Bank of play (backlash) operators, smooth"
  extends BaseClasses.PlayBank(final usesRate = true);
  extends Interfaces.Rated;
  parameter Real width(min = 0) = 1e-3 "Input on which the corner of a play is rounded, greater than 0: the bound of the error of a play";
initial equation
  z = Functions.play(u, r, z0);
equation
  connect(du, rate);
  for i in 1:n loop
    der(z[i]) = Functions.playRate(u, rate, r[i], z[i], width);
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> z_i = max(u - r_i, min(u + r_i, z_i)).</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 3.</p>
<p><b>Limitations:</b> An ordinary differential equation without events, driven by the rate of the input; a deadband width as in Simulink is 2 r. A play lags behind the exact one by at most width.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.PlayBank\">Operators.Sampled.PlayBank</a>, <a href=\"modelica://HystFMU.Operators.Events.PlayBank\">Operators.Events.PlayBank</a>, <a href=\"modelica://HystFMU.Validation.Smooth.PlayBank\">Validation.Smooth.PlayBank</a>.</p>
</html>"));
end PlayBank;
