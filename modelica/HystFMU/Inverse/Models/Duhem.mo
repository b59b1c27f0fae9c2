within HystFMU.Inverse.Models;
package Duhem "Duhem operator as a static model"
  extends BaseClasses.StaticModel;

  redeclare function extends step "Duhem operator after a new input"
  protected
    Integer q = integer(values[1]) "Degree in the state";
    Integer m = div(size(values, 1) - 6, 2 + 4*q) "Rows: degree in the input, and one";
    Integer first = if u >= state[3] then 6 else 6 + m*(1 + 2*q) "Before the coefficients of the direction";
    Real w = if state[4] < 0.5 then values[6] else Functions.duhem(u, state[3], state[2], values[first + 1:first + m], values[first + m + 1:first + m + m*q], values[first + m + m*q + 1:first + m + 2*m*q], q, values[3], values[4], integer(values[5])) "State";
  algorithm
    state_new := {values[2]*u + w, w, u, 1};
    annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = k u + w, dw/du polynomials of u and w for each direction.</p>
<p><b>Source:</b> Oh &amp; Bernstein 2005.</p>
<p><b>Limitations:</b> none</p>
</html>"));
  end step;

  annotation (Documentation(info = "<html>
<p>values = cat(1, {q, k, w_max, du_max, steps, w0}, a_rise, b_rise, c_rise, a_fall, b_fall, c_fall); state = {0, w0, 0, 0}; the last element counts the inputs up to one before the first input.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.Duhem\">Operators.Sampled.Duhem</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.ImplicitInverse\">Inverse.Sampled.ImplicitInverse</a>.</p>
</html>"));
end Duhem;
