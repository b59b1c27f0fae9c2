within HystFMU.Functions;
function duhemRungeKutta "Runge-Kutta step of the Duhem operator"
  extends Icons.Function;
  input Real u "Input";
  input Real w "State";
  input Real h "Step of the input";
  input Real a[:] "Coefficients";
  input Real b[:] "Coefficients";
  input Real c[:] "Coefficients";
  input Integer q "Degree in w";
  output Real w_new "State after the step";
protected
  Real k_1;
  Real k_2;
  Real k_3;
  Real k_4;
algorithm
  k_1 := duhemSlope(u, w, a, b, c, q);
  k_2 := duhemSlope(u + 0.5*h, w + 0.5*h*k_1, a, b, c, q);
  k_3 := duhemSlope(u + 0.5*h, w + 0.5*h*k_2, a, b, c, q);
  k_4 := duhemSlope(u + h, w + h*k_3, a, b, c, q);
  w_new := w + h/6*(k_1 + 2*(k_2 + k_3) + k_4);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> classical Runge-Kutta step of order 4 in u.</p>
<p><b>Source:</b> Kutta 1901.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>duhemRungeKutta(u, w, h, a, b, c, q)</code> in <a href=\"modelica://HystFMU.Functions.duhemStep\">Functions.duhemStep</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.duhemStep\">Functions.duhemStep</a>, <a href=\"modelica://HystFMU.Functions.duhemAcrossZero\">Functions.duhemAcrossZero</a>, which use it.</p>
</html>"));
end duhemRungeKutta;
