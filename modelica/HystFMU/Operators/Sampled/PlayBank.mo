within HystFMU.Operators.Sampled;
block PlayBank "Bank of play (backlash) operators, sampled"
  extends BaseClasses.PlayBank(z(start = z0, each fixed = true));
  extends Interfaces.Sampled;
equation
  when sample(t0, Ts) then
    z = Functions.play(u, r, pre(z));
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> a deadband width as in Simulink is 2 r.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.PlayBank\">Operators.BaseClasses.PlayBank</a>: equation, source, example.</p>
</html>"));
end PlayBank;
