within HystFMU.Functions;
function duhemSlope "Slope of the Duhem operator"
  extends Icons.Function;
  input Real u "Input";
  input Real w "State";
  input Real a[:] "Coefficients of u^i";
  input Real b[:] "Coefficients of u^i w^j, one row per i";
  input Real c[:] "Coefficients of u^i abs(w) w^(j-1), one row per i";
  input Integer q "Degree in w";
  output Real f "dw/du";
protected
  Real power "u^i";
  Real power_w "w^(j-1)";
algorithm
  f := 0;
  power := 1;
  for i in 1:size(a, 1) loop
    f := f + power*a[i];
    power_w := 1;
    for j in 1:div(size(b, 1), size(a, 1)) loop
      f := f + power*power_w*(b[(i - 1)*q + j]*w + c[(i - 1)*q + j]*abs(w));
      power_w := power_w*w;
    end for;
    power := power*u;
  end for;
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> dw/du = sum_i u<sup>i</sup> (a_i + sum_j (b_ij w<sup>j</sup> + c_ij abs(w) w<sup>j-1</sup>)).</p>
<p><b>Source:</b> Oh &amp; Bernstein 2005; Coleman &amp; Hodgdon 1986.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>duhemSlope(u, w, a_rise, b_rise, c_rise, q)</code> in <a href=\"modelica://HystFMU.Operators.Smooth.Duhem\">Operators.Smooth.Duhem</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Smooth.Duhem\">Operators.Smooth.Duhem</a>, <a href=\"modelica://HystFMU.Functions.duhemRungeKutta\">Functions.duhemRungeKutta</a>, which use it.</p>
</html>"));
end duhemSlope;
