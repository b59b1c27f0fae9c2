within HystFMU.Functions;
function jilesAthertonStep "Step of the Jiles-Atherton operator with moving walls"
  extends Icons.Function;
  input Real before[2] "Effective field and distance of the walls from the anhysteretic curve";
  input Real u "Field at the end of all steps";
  input Real s "Direction, 1 or -1";
  input Real Ms "Saturation";
  input Real a "Shape";
  input Real k "Pinning";
  input Real c "Reversible share";
  input Real alpha "Mean field for a magnetisation of 1";
  input Real steps "Number of steps per field of length min(a, k)";
  output Real after[2] "Effective field and distance after the step";
protected
  Real h = before[1] "Effective field";
  Real d = before[2] "Distance";
  Real rest = s*(u - h + alpha*(Ms*langevin(h/a) - (1 - c)*d)) "Remaining path of u";
  Real x "Path of h";
  Real lo = 0 "Lower bound of x";
  Real hi "Upper bound of x";
  Real d_x = d "Distance after x";
  Real g "Field beyond u";
  Real next;
algorithm
  x := min(rest/(1 - max(alpha*Ms/(3*a), 0)), max(min(a, k)/steps, 0.125*min(abs(h), rest - 2*abs(alpha)*Ms)));
  hi := x;
  for i in 1:8 loop
    // the whole step, or Newton's method to u with bisection if it leaves the bracket
    d_x := jilesAthertonDistance(h, d, s, x, Ms, a, k);
    g := s*(h + s*x - alpha*(Ms*langevin((h + s*x)/a) - (1 - c)*d_x) - u);
    lo := if g <= 0 then x else lo;
    hi := if g > 0 then x else hi;
    next := x - g/(1 - alpha*(c*Ms/a*langevinSlope((h + s*x)/a) + (1 - c)*s*d_x/k));
    x := if g == 0 or lo >= hi then x elseif next >= lo and next <= hi then next else 0.5*(lo + hi);
  end for;
  after := if rest > 0 then {h + s*x, jilesAthertonDistance(h, d, s, x, Ms, a, k)} else before;
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> the path x of h is at most a/steps and k/steps, or at most 1/8 of abs(h) and of the remaining path; the step does not pass h - alpha y = u.</p>
<p><b>Source:</b> Jiles &amp; Atherton, J. Magn. Magn. Mater. 61 (1986) 48-60; Sadowski et al., IEEE Trans. Magn. 38 (2002) 797-800, eq. 2-5.</p>
<p><b>Limitations:</b> alpha Ms &lt; 3 a.</p>
<p><b>Example:</b> <code>jilesAthertonStep(after, u, s, Ms, a, k, c, alpha, steps)</code> in <a href=\"modelica://HystFMU.Functions.jilesAthertonSteps\">Functions.jilesAthertonSteps</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.jilesAthertonSteps\">Functions.jilesAthertonSteps</a>, <a href=\"modelica://HystFMU.Functions.jilesAtherton\">Functions.jilesAtherton</a>, which use it.</p>
</html>"));
end jilesAthertonStep;
