within HystFMU.Operators.Events;
block StopBank "Bank of stop operators, events at reversals"
  extends BaseClasses.StopBank(final usesRate = true);
  extends Interfaces.Reversals;
protected
  discrete Real z_turn[n](start = z0, each fixed = true) "Plays at the last reversal";
equation
  connect(du, rate);
  when {initial(), change(rising)} then
    z_turn = Functions.play(u, r, pre(z_turn));
  end when;
  s = fill(u, n) - Functions.play(u, r, z_turn);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> s_i = u - z_i, z_i = max(u - r_i, min(u + r_i, z_i)).</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 3: play and stop add up to the input.</p>
<p><b>Limitations:</b> One event for each reversal of the input, in between a closed form of the input: exact whatever the solver's step; none. A jump of the input must be a ramp, because the rate tells where it turns; only the sign of the rate is used.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.StopBank\">Operators.Sampled.StopBank</a>, <a href=\"modelica://HystFMU.Operators.Smooth.StopBank\">Operators.Smooth.StopBank</a>, <a href=\"modelica://HystFMU.Validation.Events.StopBank\">Validation.Events.StopBank</a>.</p>
</html>"));
end StopBank;
