within HystFMU.Operators.Events;
block BacklashSum "Weighted sum of backlash (play) operators, plain states, events at reversals"
  extends BaseClasses.BacklashSum(final usesRate = true);
  extends Interfaces.Reversals;
protected
  discrete Real z_turn[n](start = z0, each fixed = true) "Plays at the last reversal";
equation
  connect(du, rate);
  when {initial(), change(rising)} then
    z_turn = Functions.play(u, r, pre(z_turn));
  end when;
  y = w0*u + w*Functions.play(u, r, z_turn);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> z_i = max(u - r_i, min(u + r_i, z_i)), y = w0 u + sum_i w_i z_i.</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, section II; Krejci &amp; Kuhnen 2001, eq. 3.</p>
<p><b>Limitations:</b> One event for each reversal of the input, in between a closed form of the input: exact whatever the solver's step; none. A jump of the input must be a ramp, because the rate tells where it turns; only the sign of the rate is used.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.BacklashSum\">Operators.Sampled.BacklashSum</a>, <a href=\"modelica://HystFMU.Operators.Smooth.BacklashSum\">Operators.Smooth.BacklashSum</a>, <a href=\"modelica://HystFMU.Validation.Events.BacklashSum\">Validation.Events.BacklashSum</a>.</p>
</html>"));
end BacklashSum;
