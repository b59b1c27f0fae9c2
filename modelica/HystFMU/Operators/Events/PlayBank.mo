within HystFMU.Operators.Events;
block PlayBank "Bank of play (backlash) operators, events at reversals"
  extends BaseClasses.PlayBank(final usesRate = true);
  extends Interfaces.Reversals;
protected
  discrete Real z_turn[n](start = z0, each fixed = true) "Plays at the last reversal";
equation
  connect(du, rate);
  when {initial(), change(rising)} then
    z_turn = Functions.play(u, r, pre(z_turn));
  end when;
  z = Functions.play(u, r, z_turn);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> z_i = max(u - r_i, min(u + r_i, z_i)).</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 3.</p>
<p><b>Limitations:</b> One event for each reversal of the input, in between a closed form of the input: exact whatever the solver's step; a deadband width as in Simulink is 2 r. A jump of the input must be a ramp, because the rate tells where it turns; only the sign of the rate is used.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.PlayBank\">Operators.Sampled.PlayBank</a>, <a href=\"modelica://HystFMU.Operators.Smooth.PlayBank\">Operators.Smooth.PlayBank</a>, <a href=\"modelica://HystFMU.Validation.Events.PlayBank\">Validation.Events.PlayBank</a>.</p>
</html>"));
end PlayBank;
