within HystFMU.Functions;
function duhemSlope "Slope of the Duhem operator"
  extends Icons.Function;
  input Real u "Input";
  input Real w "State";
  input Real a[:] "Coefficients of B_i";
  input Real b[:] "Coefficients of B_i w^j, one row per i";
  input Real c[:] "Coefficients of B_i abs(w) w^(j-1), one row per i";
  input Integer q "Degree in w";
  output Real f "dw/du";
protected
  Integer degree = min(size(a, 1) - 1, 2) "Degree of the splines";
  Integer cells = max(size(a, 1) - degree, 1) "Number of cells of their grid";
  Real x = (min(max(u, -1), 1) + 1)/2*cells "Place on the grid";
  Real y "Distance from the middle of a spline";
  Real spline "B_i";
  Real power "w^(j-1)";
algorithm
  f := 0;
  for i in 1:size(a, 1) loop
    y := abs(x - i + 0.5 + degree/2);
    spline := if degree == 0 then 1 elseif degree == 1 then max(1 - y, 0) elseif y < 0.5 then 0.75 - y*y else max(1.5 - y, 0)*max(1.5 - y, 0)/2;
    f := f + spline*a[i];
    power := 1;
    for j in 1:div(size(b, 1), size(a, 1)) loop
      f := f + spline*power*(b[(i - 1)*q + j]*w + c[(i - 1)*q + j]*abs(w));
      power := power*w;
    end for;
  end for;
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> dw/du = sum_i B_i(u) (a_i + sum_j (b_ij w<sup>j</sup> + c_ij abs(w) w<sup>j-1</sup>)); the B_i are uniform B-splines of degree 2 (of degree 0 or 1 if there are one or two of them) on [-1, 1], and constant outside.</p>
<p><b>Source:</b> Oh &amp; Bernstein 2005; Coleman &amp; Hodgdon 1986.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>duhemSlope(u, w, a_rise, b_rise, c_rise, q)</code> in <a href=\"modelica://HystFMU.Operators.Smooth.Duhem\">Operators.Smooth.Duhem</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Smooth.Duhem\">Operators.Smooth.Duhem</a>, <a href=\"modelica://HystFMU.Functions.duhemRungeKutta\">Functions.duhemRungeKutta</a>, which use it.</p>
</html>"));
end duhemSlope;
