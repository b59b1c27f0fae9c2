within HystFMU.Operators.Sampled;
block StopBank "Bank of stop operators, sampled"
  extends BaseClasses.StopBank(s(each start = 0, each fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real z[n](start = z0, each fixed = true) "Plays";
equation
  when sample(t0, Ts) then
    z = Functions.play(u, r, pre(z));
    s = fill(u, n) - z;
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> none.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.StopBank\">Operators.BaseClasses.StopBank</a>: equation, source, example.</p>
</html>"));
end StopBank;
