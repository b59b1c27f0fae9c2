within HystFMU.Inverse.Models;
package ZhaoTan "Zhao-Tan operator as a static model"
  extends BaseClasses.StaticModel;

  redeclare function extends step "Zhao-Tan operator after a new input"
  protected
    Boolean last = values[2] > 1.5 "True if only the last extremum is stored";
    Real memory[size(state, 1) - 1] = Functions.turn(u, values[1], state[1], state[2:size(state, 1)], last) "Extrema";
  algorithm
    state_new := cat(1, {Functions.zhaoTan(u, Functions.branchOrigin(memory, values[1], 0, if last then 1 else 2))}, memory);
    annotation (Documentation(info = "<html>
<p><b>Equation:</b> h = h_p + sgn(x - x_p) (1 - e<sup>-d</sup>) d, d = abs(x - x_p).</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, section III.</p>
<p><b>Limitations:</b> none</p>
</html>"));
  end step;

  annotation (Documentation(info = "<html>
<p>values = {x0, Integer(memory)}; state0 = cat(1, {0, 0, 0, x0}, zeros(2*depth)).</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.ZhaoTan\">Operators.Sampled.ZhaoTan</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.ImplicitInverse\">Inverse.Sampled.ImplicitInverse</a>.</p>
</html>"));
end ZhaoTan;
