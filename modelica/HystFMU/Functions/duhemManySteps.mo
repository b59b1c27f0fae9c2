within HystFMU.Functions;
function duhemManySteps "Up to ten thousand steps of the Duhem operator"
  extends Icons.Function;
  input Real u_last "Last input";
  input Real w_first "State at the last input";
  input Real h "Step of the input";
  input Real m "Number of steps";
  input Real a[:] "Coefficients of the direction";
  input Real b[:] "Coefficients";
  input Real c[:] "Coefficients";
  input Integer q "Degree in w";
  input Real w_max "Bound of abs(w)";
  output Real w "State after the steps";
algorithm
  w := w_first;
  for i in 0:499 loop
    // one call inside an if skips twenty steps
    if 20*i < m then
      w := duhemSteps(u_last, w, h, 20*i, m, a, b, c, q, w_max);
    end if;
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> repeats duhemSteps.</p>
<p><b>Source:</b> Oh &amp; Bernstein 2005.</p>
<p><b>Limitations:</b> m &le; 10000.</p>
<p><b>Example:</b> <code>duhemManySteps(u_last, w_last, h, m, a, b, c, q, w_max)</code> in <a href=\"modelica://HystFMU.Functions.duhem\">Functions.duhem</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.duhem\">Functions.duhem</a>, which uses it.</p>
</html>"));
end duhemManySteps;
