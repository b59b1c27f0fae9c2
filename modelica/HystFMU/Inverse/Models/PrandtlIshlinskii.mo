within HystFMU.Inverse.Models;
package PrandtlIshlinskii "Prandtl-Ishlinskii operator as a static model"
  extends BaseClasses.StaticModel;

  redeclare function extends step "Prandtl-Ishlinskii operator after a new input"
  protected
    Integer n = div(size(values, 1) - 2, 2) "Number of plays";
    Real memory[size(state, 1) - 1] = Functions.turn(u, values[2], state[1], state[2:size(state, 1)]) "Dominant extrema";
    Real rest = (values[1] + sum(values[n + 3:2*n + 2]))*values[2] "Output at rest";
    Real y = Functions.prandtlIshlinskii(u, Functions.branchOrigin(memory, values[2], rest, 2), values[1], values[3:n + 2], values[n + 3:2*n + 2]) "Output";
  algorithm
    state_new := cat(1, {y}, memory);
    annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = w0 u + sum_i w_i p_{r_i}[u].</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001.</p>
<p><b>Limitations:</b> an inverse exists only if the loading curve increases; Inverse.Sampled.PrandtlIshlinskiiInverse has the closed form.</p>
</html>"));
  end step;

  annotation (Documentation(info = "<html>
<p>values = cat(1, {w0, u0}, r, w); state0 = cat(1, {0, 0, 0, u0}, zeros(2*depth)).</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.PrandtlIshlinskii\">Operators.Sampled.PrandtlIshlinskii</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.ImplicitInverse\">Inverse.Sampled.ImplicitInverse</a>.</p>
</html>"));
end PrandtlIshlinskii;
