within HystFMU.Inverse.Models;
package BacklashSum "Weighted sum of plays as a static model"
  extends BaseClasses.StaticModel;

  redeclare function extends step "Weighted sum of plays after a new input"
  protected
    Integer n = div(size(values, 1) - 1, 2) "Number of plays";
    Real z[div(size(values, 1) - 1, 2)] = Functions.play(u, values[2:n + 1], state[2:n + 1]) "Play states";
  algorithm
    state_new := cat(1, {values[1]*u + values[n + 2:2*n + 1]*z}, z);
    annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = w0 u + sum_i w_i z_i.</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001.</p>
<p><b>Limitations:</b> an inverse exists only if w0 &gt; 0.</p>
</html>"));
  end step;

  annotation (Documentation(info = "<html>
<p>values = cat(1, {w0}, r, w); state0 = cat(1, {0}, z0).</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.BacklashSum\">Operators.Sampled.BacklashSum</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.ImplicitInverse\">Inverse.Sampled.ImplicitInverse</a>.</p>
</html>"));
end BacklashSum;
