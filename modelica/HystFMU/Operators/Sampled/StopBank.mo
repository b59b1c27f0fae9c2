within HystFMU.Operators.Sampled;
block StopBank "Bank of stop operators, sampled"
  extends BaseClasses.StopBank;
  extends Interfaces.Sampled;
protected
  discrete Real z[n](start = z0, each fixed = true) "Plays";
equation
  when sample(0, Ts) then
    z = Functions.play(u, r, pre(z));
    s = fill(u, n) - z;
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> s_i = u - z_i, z_i = max(u - r_i, min(u + r_i, z_i)).</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 3: play and stop add up to the input.</p>
<p><b>Limitations:</b> Acts at 0, Ts, 2 Ts, ...: the unit of the same name stepped with Ts; extrema between two samples are not seen; none.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Events.StopBank\">Operators.Events.StopBank</a>, <a href=\"modelica://HystFMU.Operators.Smooth.StopBank\">Operators.Smooth.StopBank</a>, <a href=\"modelica://HystFMU.Validation.Sampled.StopBank\">Validation.Sampled.StopBank</a>.</p>
</html>"));
end StopBank;
