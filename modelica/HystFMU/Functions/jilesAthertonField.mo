within HystFMU.Functions;
function jilesAthertonField "Effective field of the Jiles-Atherton operator"
  extends Icons.Function;
  input Real u "Field";
  input Real m "Irreversible part of the magnetisation";
  input Real Ms "Saturation";
  input Real a "Shape";
  input Real c "Reversible share";
  input Real alpha "Mean field for a magnetisation of 1";
  output Real h "Effective field";
protected
  Real lo = u + alpha*(1 - c)*m - abs(alpha)*c*Ms "Lower bound of h";
  Real hi = lo + 2*abs(alpha)*c*Ms "Upper bound of h";
  Real g;
  Real next;
algorithm
  h := 0.5*(lo + hi);
  for i in 1:12 loop
    // Newton's method, with bisection if it leaves the bracket
    g := h - alpha*((1 - c)*m + c*Ms*langevin(h/a)) - u;
    lo := if g <= 0 then h else lo;
    hi := if g > 0 then h else hi;
    next := h - g/(1 - alpha*c*Ms/a*langevinSlope(h/a));
    h := if g == 0 then h elseif next >= lo and next <= hi then next else 0.5*(lo + hi);
  end for;
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> h = u + alpha y, y = (1 - c) m + c Ms L(h/a).</p>
<p><b>Source:</b> Jiles &amp; Atherton, J. Magn. Magn. Mater. 61 (1986) 48-60; bracketed Newton's method.</p>
<p><b>Limitations:</b> alpha Ms &lt; 3 a.</p>
<p><b>Example:</b> <code>jilesAthertonField(u, m, Ms, a, c, alpha)</code> in <a href=\"modelica://HystFMU.Functions.jilesAthertonOutput\">Functions.jilesAthertonOutput</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.jilesAthertonOutput\">Functions.jilesAthertonOutput</a>, <a href=\"modelica://HystFMU.Functions.jilesAtherton\">Functions.jilesAtherton</a>, which use it.</p>
</html>"));
end jilesAthertonField;
