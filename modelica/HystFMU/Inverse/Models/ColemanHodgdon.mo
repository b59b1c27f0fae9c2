within HystFMU.Inverse.Models;
package ColemanHodgdon "Coleman-Hodgdon operator as a static model"
  extends BaseClasses.StaticModel;

  redeclare function extends step "Coleman-Hodgdon operator after a new input"
  protected
    Real w = Functions.colemanHodgdon(u, state[3], state[2], values[1], values[3] - values[2]) "y - b u";
  algorithm
    state_new := {values[2]*u + w, w, u};
    annotation (Documentation(info = "<html>
<p><b>Equation:</b> y' = alpha abs(u') (b u - y) + k u'.</p>
<p><b>Source:</b> Coleman &amp; Hodgdon 1986.</p>
<p><b>Limitations:</b> none</p>
</html>"));
  end step;

  annotation (Documentation(info = "<html>
<p>values = {alpha, b, k}; state0 = {0, y0 - b*u0, u0}.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.ColemanHodgdon\">Operators.Sampled.ColemanHodgdon</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.ImplicitInverse\">Inverse.Sampled.ImplicitInverse</a>.</p>
</html>"));
end ColemanHodgdon;
