within HystFMU.Inverse.Models;
package DeadZones "Weighted sum of dead zones as a static model"
  extends BaseClasses.StaticModel;

  redeclare function extends step "Weighted sum of dead zones at a new input"
  protected
    Integer n = div(size(values, 1) - 1, 2) "Number of dead zones";
  algorithm
    state_new := {values[1]*u + values[n + 2:2*n + 1]*Functions.deadZone(u, values[2:n + 1])};
    annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = w0 u + sum_i w_i S_{r_i}(u).</p>
<p><b>Source:</b> Kuhnen, European Journal of Control 9 (2003) 407-418.</p>
<p><b>Limitations:</b> the slopes must be positive for an inverse to exist.</p>
</html>"));
  end step;

  annotation (Documentation(info = "<html>
<p>values = cat(1, {w0}, r, w); state0 = {0}.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.DeadZones\">Operators.DeadZones</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.ImplicitInverse\">Inverse.Sampled.ImplicitInverse</a>.</p>
</html>"));
end DeadZones;
