within HystFMU.Functions;
function duhemSteps "Twenty steps of the Duhem operator"
  extends Icons.Function;
  input Real u_last "Input before all steps";
  input Real w_first "State before the first of these steps";
  input Real h "Step of the input";
  input Integer first "Number of steps before the first of these steps";
  input Real m "Number of all steps";
  input Real a[:] "Coefficients of the direction";
  input Real b[:] "Coefficients";
  input Real c[:] "Coefficients";
  input Integer q "Degree in w";
  input Real w_max "Bound of abs(w)";
  output Real w "State after the steps";
algorithm
  w := w_first;
  for i in 0:19 loop
    if first + i < m then
      w := duhemStep(u_last + (first + i)*h, w, h, a, b, c, q, w_max);
    end if;
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> repeats duhemStep.</p>
<p><b>Source:</b> Oh &amp; Bernstein 2005.</p>
<p><b>Limitations:</b> always twenty steps, because the loops of rumoca 0.10.2 have a fixed length.</p>
<p><b>Example:</b> <code>duhemSteps(u_last, w, h, 20*i, m, a, b, c, q, w_max)</code> in <a href=\"modelica://HystFMU.Functions.duhemManySteps\">Functions.duhemManySteps</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.duhem\">Functions.duhem</a>, <a href=\"modelica://HystFMU.Functions.duhemManySteps\">Functions.duhemManySteps</a>, which use it.</p>
</html>"));
end duhemSteps;
