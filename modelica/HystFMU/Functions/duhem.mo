within HystFMU.Functions;
function duhem "State of the Duhem operator after a new input of one direction"
  extends Icons.Function;
  input Real u "New input";
  input Real u_last "Last input";
  input Real w_last "State at the last input";
  input Real a[:] "Coefficients of the direction";
  input Real b[:] "Coefficients";
  input Real c[:] "Coefficients";
  input Integer q "Degree in w";
  input Real w_max "Bound of abs(w)";
  input Real du_max "Longest integration step";
  output Real w "State at u";
protected
  Real m = min(floor(abs(u - u_last)/du_max) + 1, 10000) "Number of steps";
  Real h = (u - u_last)/m "Step";
algorithm
  if m <= 20 then
    w := duhemSteps(u_last, w_last, h, 0, m, a, b, c, q, w_max);
  else
    w := duhemManySteps(u_last, w_last, h, m, a, b, c, q, w_max);
  end if;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> integral of dw/du from u_last to u in Runge-Kutta steps of at most du_max, with at most 10000 steps.</p>
<p><b>Source:</b> Oh &amp; Bernstein 2005.</p>
<p><b>Limitations:</b> the input must not have a reversal between u_last and u.</p>
<p><b>Example:</b> <code>duhem(u, pre(u_last), pre(w_last), a_rise, b_rise, c_rise, q, w_max, du_max)</code> in <a href=\"modelica://HystFMU.Operators.Sampled.Duhem\">Operators.Sampled.Duhem</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.Duhem\">Operators.Sampled.Duhem</a>, which uses it.</p>
</html>"));
end duhem;
