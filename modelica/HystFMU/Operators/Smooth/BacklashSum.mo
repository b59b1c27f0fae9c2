within HystFMU.Operators.Smooth;
block BacklashSum "Weighted sum of backlash (play) operators, plain states, smooth"
  extends BaseClasses.BacklashSum(final usesRate = true);
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
  y = w0*u + w*z;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> z_i = max(u - r_i, min(u + r_i, z_i)), y = w0 u + sum_i w_i z_i.</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, section II; Krejci &amp; Kuhnen 2001, eq. 3.</p>
<p><b>Limitations:</b> An ordinary differential equation without events, driven by the rate of the input; none. A play lags behind the exact one by at most width.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.BacklashSum\">Operators.Sampled.BacklashSum</a>, <a href=\"modelica://HystFMU.Operators.Events.BacklashSum\">Operators.Events.BacklashSum</a>, <a href=\"modelica://HystFMU.Validation.Smooth.BacklashSum\">Validation.Smooth.BacklashSum</a>.</p>
</html>"));
end BacklashSum;
