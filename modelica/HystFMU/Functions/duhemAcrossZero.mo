within HystFMU.Functions;
function duhemAcrossZero "Step of the Duhem operator across w = 0"
  extends Icons.Function;
  input Real u "Input";
  input Real w "State";
  input Real h "Step of the input";
  input Real next "State after a step that ignores the corner";
  input Real a[:] "Coefficients";
  input Real b[:] "Coefficients";
  input Real c[:] "Coefficients";
  input Integer q "Degree in w";
  output Real w_new "State after the step";
protected
  Real k_1 = 1/duhemSlope(u, w, a, b, c, q);
  Real k_2 = 1/duhemSlope(u - 0.5*w*k_1, 0.5*w, a, b, c, q);
  Real k_3 = 1/duhemSlope(u - 0.5*w*k_2, 0.5*w, a, b, c, q);
  Real k_4 = 1/duhemSlope(u - w*k_3, 0, a, b, c, q);
  Real way = -w/6*(k_1 + 2*(k_2 + k_3) + k_4) "Path to w = 0";
algorithm
  w_new := if way*h > 0 and abs(way) < abs(h) then duhemRungeKutta(u + way, 0, h - way, a, b, c, q) else next;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> one Runge-Kutta step of du/dw to w = 0, then one of dw/du over the rest.</p>
<p><b>Source:</b> the way to the corner with w as the independent variable: Henon 1982.</p>
<p><b>Limitations:</b> w and next must have opposite signs.</p>
<p><b>Example:</b> <code>duhemAcrossZero(u, w, h, next, a, b, c, q)</code> in <a href=\"modelica://HystFMU.Functions.duhemStep\">Functions.duhemStep</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.duhemStep\">Functions.duhemStep</a>, which uses it.</p>
</html>"));
end duhemAcrossZero;
