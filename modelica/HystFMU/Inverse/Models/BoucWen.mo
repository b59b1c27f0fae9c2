within HystFMU.Inverse.Models;
package BoucWen "Bouc-Wen operator as a static model"
  extends BaseClasses.StaticModel;

  redeclare function extends step "Bouc-Wen operator after a new input"
  protected
    Real z = Functions.boucWen(u, state[3], state[2], values[1], values[2], values[3], values[4]) "Hysteretic part";
  algorithm
    state_new := {values[6]*(values[5]*u + (1 - values[5])*z), z, u};
    annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = k (alpha u + (1 - alpha) z), dz/du = A - (beta sgn(u' z) + gamma) abs(z)<sup>n</sup>.</p>
<p><b>Source:</b> Wen 1976.</p>
<p><b>Limitations:</b> none</p>
</html>"));
  end step;

  annotation (Documentation(info = "<html>
<p>values = {A, beta, gamma, n, alpha, k}; state0 = {0, z0, u0}.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.BoucWen\">Operators.Sampled.BoucWen</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.ImplicitInverse\">Inverse.Sampled.ImplicitInverse</a>.</p>
</html>"));
end BoucWen;
