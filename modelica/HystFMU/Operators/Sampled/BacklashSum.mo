within HystFMU.Operators.Sampled;
block BacklashSum "Weighted sum of backlash (play) operators, plain states, sampled"
  extends BaseClasses.BacklashSum(y(start = w*z0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real z[n](start = z0, each fixed = true) "Play states";
equation
  when sample(0, Ts) then
    z = Functions.play(u, r, pre(z));
    y = w0*u + w*z;
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> z_i = max(u - r_i, min(u + r_i, z_i)), y = w0 u + sum_i w_i z_i.</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, section II; Krejci &amp; Kuhnen 2001, eq. 3.</p>
<p><b>Limitations:</b> Acts at 0, Ts, 2 Ts, ...: the unit of the same name stepped with Ts; extrema between two samples are not seen; none.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Events.BacklashSum\">Operators.Events.BacklashSum</a>, <a href=\"modelica://HystFMU.Operators.Smooth.BacklashSum\">Operators.Smooth.BacklashSum</a>, <a href=\"modelica://HystFMU.Validation.Sampled.BacklashSum\">Validation.Sampled.BacklashSum</a>.</p>
</html>"));
end BacklashSum;
