within HystFMU.Inverse.Models;
package Duhem "Duhem operator as a static model"
  extends BaseClasses.StaticModel;

  redeclare function extends step "Duhem operator after a new input"
  protected
    Integer q = size(state, 1) - 3 "Degree in w";
    Integer n = div(size(values, 1) - 3, 2*(2*size(state, 1) - 5)) "Number of powers of u";
    Real rise = Functions.duhem(u, state[3], state[2], values[4:n + 3], values[n + 4:n + n*q + 3], values[n + n*q + 4:n + 2*n*q + 3], q, values[2], values[3]) "State after a rising input";
    Real fall = Functions.duhem(u, state[3], state[2], values[n + 2*n*q + 4:2*n + 2*n*q + 3], values[2*n + 2*n*q + 4:2*n + 3*n*q + 3], values[2*n + 3*n*q + 4:2*n + 4*n*q + 3], q, values[2], values[3]) "State after a falling input";
    Real w = if u >= state[3] then rise else fall "State";
  algorithm
    state_new := cat(1, {values[1]*u + w, w, u}, zeros(q));
    annotation (Documentation(info = "<html>
<p><b>Equation:</b> dw/du = sum_i u<sup>i</sup> (a_i + sum_j (b_ij w<sup>j</sup> + c_ij |w| w<sup>j-1</sup>)), y = k u + w.</p>
<p><b>Source:</b> Oh &amp; Bernstein 2005.</p>
<p><b>Limitations:</b> none.</p>
</html>"));
  end step;

  annotation (Documentation(info = "<html>
<p>The size of state0 gives q: values = cat(1, {k, w_max, du_max}, a_rise, b_rise, c_rise, a_fall, b_fall, c_fall); state0 = cat(1, {0, w0, u0}, zeros(q)).</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.Duhem\">Operators.Sampled.Duhem</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.ImplicitInverse\">Inverse.Sampled.ImplicitInverse</a>.</p>
</html>"));
end Duhem;
