within HystFMU.Functions;
function jilesAthertonRelease "Effective field at which the walls of the Jiles-Atherton operator begin to move"
  extends Icons.Function;
  input Real m "Irreversible part of the magnetisation";
  input Real h_pinned "Effective field at which the walls are pinned";
  input Real h_moving "Effective field at which the walls move";
  input Real Ms "Saturation";
  input Real a "Shape";
  output Real h "Effective field between these two with f(h) = m";
protected
  Real lo = min(h_pinned, h_moving) "Bound of h where f < m";
  Real hi = max(h_pinned, h_moving) "Bound of h where f > m";
  Real g;
  Real next;
algorithm
  h := 0.5*(lo + hi);
  for i in 1:20 loop
    // Newton's method, with bisection if it leaves the bracket
    g := Ms*langevin(h/a) - m;
    lo := if g <= 0 then h else lo;
    hi := if g > 0 then h else hi;
    next := h - g/max(Ms/a*langevinSlope(h/a), 1e-300);
    h := if g == 0 then h elseif next >= lo and next <= hi then next else 0.5*(lo + hi);
  end for;
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> Ms L(h/a) = m.</p>
<p><b>Source:</b> Jiles &amp; Atherton, J. Magn. Magn. Mater. 61 (1986) 48-60: the walls move where the anhysteretic curve has passed them; bracketed Newton's method.</p>
<p><b>Limitations:</b> f - m must have opposite signs at the two fields.</p>
<p><b>Example:</b> <code>jilesAthertonRelease(m_last, h, h_pinned, Ms, a)</code> in <a href=\"modelica://HystFMU.Functions.jilesAtherton\">Functions.jilesAtherton</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.jilesAtherton\">Functions.jilesAtherton</a>, which uses it.</p>
</html>"));
end jilesAthertonRelease;
