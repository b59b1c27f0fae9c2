within HystFMU.Operators.Sampled;
block PlayBank "Bank of play (backlash) operators, sampled"
  extends BaseClasses.PlayBank(z(start = z0, each fixed = true));
  extends Interfaces.Sampled;
equation
  when sample(0, Ts) then
    z = Functions.play(u, r, pre(z));
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> z_i = max(u - r_i, min(u + r_i, z_i)).</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 3.</p>
<p><b>Limitations:</b> Acts at 0, Ts, 2 Ts, ...: the unit of the same name stepped with Ts; extrema between two samples are not seen; a deadband width as in Simulink is 2 r.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Events.PlayBank\">Operators.Events.PlayBank</a>, <a href=\"modelica://HystFMU.Operators.Smooth.PlayBank\">Operators.Smooth.PlayBank</a>, <a href=\"modelica://HystFMU.Validation.Sampled.PlayBank\">Validation.Sampled.PlayBank</a>.</p>
</html>"));
end PlayBank;
