within HystFMU.Inverse.Models;
package ConstraintFactor "Constraint-factor operator as a static model"
  extends BaseClasses.StaticModel;

  redeclare function extends step "Constraint-factor operator after a new input"
  protected
    Boolean last = values[3] > 1.5 "True if only the last extremum is stored";
    Real memory[size(state, 1) - 1] = Functions.turn(u, values[4], state[1], state[2:size(state, 1)], last) "Extrema";
    Real h = Functions.constraintFactor(u, Functions.branchOrigin(memory, values[4], 0, if last then 1 else 2), values[1], values[5:size(values, 1)], values[2]) "Output";
  algorithm
    state_new := cat(1, {h}, memory);
    annotation (Documentation(info = "<html>
<p><b>Equation:</b> h = h_p + sgn(x - x_p) (1 - e<sup>-d</sup>) (a0 + sum_j a_j d<sup>2j-1</sup>), d = abs(x - x_p).</p>
<p><b>Source:</b> Shen &amp; Ma 2017, eq. 1-2.</p>
<p><b>Limitations:</b> none</p>
</html>"));
  end step;

  annotation (Documentation(info = "<html>
<p>values = cat(1, {a0, d_max, Integer(memory), x0}, a); state0 = cat(1, {0, 0, 0, x0}, zeros(2*depth)).</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.ConstraintFactor\">Operators.Sampled.ConstraintFactor</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.ImplicitInverse\">Inverse.Sampled.ImplicitInverse</a>.</p>
</html>"));
end ConstraintFactor;
