within HystFMU.Operators.Sampled;
block BacklashSum "Weighted sum of backlash (play) operators, plain states, sampled"
  extends BaseClasses.BacklashSum(y(start = w*z0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real z[n](start = z0, each fixed = true) "Play states";
equation
  when sample(t0, Ts) then
    z = Functions.play(u, r, pre(z));
    y = w0*u + w*z;
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> none.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.BacklashSum\">Operators.BaseClasses.BacklashSum</a>: equation, source, example.</p>
</html>"));
end BacklashSum;
