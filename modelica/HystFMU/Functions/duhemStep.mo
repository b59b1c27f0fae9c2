within HystFMU.Functions;
function duhemStep "Step of the Duhem operator"
  extends Icons.Function;
  input Real u "Input";
  input Real w "State";
  input Real h "Step of the input";
  input Real a[:] "Coefficients";
  input Real b[:] "Coefficients";
  input Real c[:] "Coefficients";
  input Integer q "Degree in w";
  input Real w_max "Bound of abs(w)";
  output Real w_new "State after the step";
protected
  Real next = duhemRungeKutta(u, w, h, a, b, c, q);
algorithm
  if w*next < 0 then
    next := duhemAcrossZero(u, w, h, next, a, b, c, q);
  end if;
  if next > w_max then
    w_new := w_max;
  elseif next < -w_max then
    w_new := -w_max;
  elseif abs(next) <= w_max then
    w_new := next;
  else
    // the step overflowed to NaN before the bound
    w_new := if h*duhemSlope(u, w, a, b, c, q) > 0 then w_max else -w_max;
  end if;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> a Runge-Kutta step, divided at w = 0; abs(w) is limited to w_max.</p>
<p><b>Source:</b> Oh &amp; Bernstein 2005; the cut keeps the order at the corner of abs(w).</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>duhemStep(u_last + (first + i)*h, w, h, a, b, c, q, w_max)</code> in <a href=\"modelica://HystFMU.Functions.duhemSteps\">Functions.duhemSteps</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.duhemSteps\">Functions.duhemSteps</a>, which uses it.</p>
</html>"));
end duhemStep;
