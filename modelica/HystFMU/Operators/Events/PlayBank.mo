within HystFMU.Operators.Events;
block PlayBank "Bank of play (backlash) operators, events at reversals"
  extends BaseClasses.PlayBank(final usesRate = true);
  extends Interfaces.Reversals(eps = 1e-9*max(r));
protected
  discrete Real z_turn[n](start = z0, each fixed = true) "Plays at the last reversal";
equation
  connect(du, rate) annotation (Line(points = {{-110, -70}, {-80, -70}}, color = {0, 0, 127}));
  when {initial(), change(rising)} then
    z_turn = Functions.play(u, r, pre(z_turn));
  end when;
  for i in 1:n loop
    z[i] = noEvent(max(u - r[i], min(u + r[i], z_turn[i])));
  end for;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> a deadband width as in Simulink is 2 r.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.PlayBank\">Operators.BaseClasses.PlayBank</a>: equation, source, example.</p>
</html>"));
end PlayBank;
