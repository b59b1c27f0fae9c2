within HystFMU.Inverse.Models;
package JilesAtherton "Jiles-Atherton operator as a static model"
  extends BaseClasses.StaticModel;

  redeclare function extends step "Jiles-Atherton operator after a new field"
  protected
    Real m = Functions.jilesAtherton(u, state[3], state[2], values[1], values[2], values[3], values[4], values[5], values[6]) "Irreversible part";
  algorithm
    state_new := {Functions.jilesAthertonOutput(u, m, values[1], values[2], values[4], values[5]), m, u};
    annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = (1 - c) m + c f(h), dm/dh = max(0, s (f(h) - m))/k, h = u + alpha y.</p>
<p><b>Source:</b> Jiles &amp; Atherton 1986.</p>
<p><b>Limitations:</b> alpha Ms &lt; 3 a</p>
</html>"));
  end step;

  annotation (Documentation(info = "<html>
<p>values = {Ms, a, k, c, alpha, steps}; state0 = {0, m0, u0}.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.JilesAtherton\">Operators.Sampled.JilesAtherton</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.ImplicitInverse\">Inverse.Sampled.ImplicitInverse</a>.</p>
</html>"));
end JilesAtherton;
