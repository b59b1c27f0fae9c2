within HystFMU.Operators.Sampled;
block JilesAtherton "Jiles-Atherton operator, sampled"
  extends BaseClasses.JilesAtherton(y(start = 0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real u_last(start = u0, fixed = true) "Field at the last sample";
  discrete Real m_last(start = m0, fixed = true) "Irreversible part at the last sample";
equation
  assert(alpha*Ms < 3*a, "alpha Ms must be less than 3 a, otherwise the anhysteretic curve jumps");
  when sample(t0, Ts) then
    m_last = Functions.jilesAtherton(u, pre(u_last), pre(m_last), Ms, a, k, c, alpha, steps);
    u_last = u;
    y = Functions.jilesAthertonOutput(u, m_last, Ms, a, c, alpha);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> at most 500 integration steps per sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.JilesAtherton\">Operators.BaseClasses.JilesAtherton</a>: equation, source, example.</p>
</html>"));
end JilesAtherton;
