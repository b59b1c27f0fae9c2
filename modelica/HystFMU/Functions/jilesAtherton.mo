within HystFMU.Functions;
function jilesAtherton "Irreversible part of the Jiles-Atherton operator after a new input"
  extends Icons.Function;
  input Real u "New input";
  input Real u_last "Last input";
  input Real m_last "Irreversible part at the last input";
  input Real Ms "Saturation";
  input Real a "Shape";
  input Real k "Pinning";
  input Real c "Reversible share";
  input Real alpha "Mean field for a magnetisation of 1";
  input Real steps "Number of steps per field of length min(a, k)";
  output Real m "Irreversible part at u";
protected
  Real s = if u >= u_last then 1 else -1 "Direction";
  Real h = jilesAthertonField(u_last, m_last, Ms, a, c, alpha) "Last effective field";
  Real h_pinned = jilesAthertonField(u, m_last, Ms, a, c, alpha) "New effective field if the walls do not move";
  Real d = Ms*langevin(h/a) - m_last "Distance of the walls from the anhysteretic curve";
  Boolean moves = s*(Ms*langevin(h_pinned/a) - m_last) > 0 "True if the walls move at the end";
  Real after[2] "New effective field and distance";
algorithm
  if s*d < 0 then
    h := if moves then jilesAthertonRelease(m_last, h, h_pinned, Ms, a) else h;
    d := 0;
  end if;
  m := m_last;
  if moves and (u > u_last or u < u_last) then
    after := jilesAthertonStep({h, d}, u, s, Ms, a, k, c, alpha, steps);
    if s*(u - after[1] + alpha*(Ms*langevin(after[1]/a) - (1 - c)*after[2])) > 1e-14*(abs(u) + a) then
      after := jilesAthertonManySteps(after, u, s, Ms, a, k, c, alpha, steps);
    end if;
    m := Ms*langevin(after[1]/a) - after[2];
  end if;
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> dm/dh = max(0, s (f(h) - m))/k, f(h) = Ms L(h/a), h = u + alpha y, y = (1 - c) m + c f(h), integrated from u_last to u.</p>
<p><b>Source:</b> Jiles &amp; Atherton, J. Magn. Magn. Mater. 61 (1986) 48-60; Sadowski et al., IEEE Trans. Magn. 38 (2002) 797-800, eq. 2-5.</p>
<p><b>Limitations:</b> the input must not have a reversal between u_last and u.</p>
<p><b>Example:</b> <code>jilesAtherton(u, pre(u_last), pre(m_last), Ms, a, k, c, alpha, steps)</code> in <a href=\"modelica://HystFMU.Operators.Sampled.JilesAtherton\">Operators.Sampled.JilesAtherton</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.JilesAtherton\">Operators.Sampled.JilesAtherton</a>, <a href=\"modelica://HystFMU.Operators.Smooth.JilesAtherton\">Operators.Smooth.JilesAtherton</a>, which use it.</p>
</html>"));
end jilesAtherton;
