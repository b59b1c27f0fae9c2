within HystFMU.Inverse.Models;
package Preisach "Preisach operator as a static model"
  extends BaseClasses.StaticModel;

  redeclare function extends step "Preisach operator after a new input"
  protected
    // 3 + (2 n + 1) + n (n + 1)/2 values
    Integer n = integer((sqrt(8*size(values, 1) - 7) - 5)/2 + 0.5) "Number of grid steps";
    Real x = min(max(u, values[1]), values[2]) "Input, limited to the grid";
    Real memory[size(state, 1) - 1] = Functions.turn(x, values[3], state[1], state[2:size(state, 1)]) "Dominant extrema";
    Real y = Functions.preisach(x, memory, values[1], values[2], n, values[2*n + 5:size(values, 1)], values[4:2*n + 4]) "Output";
  algorithm
    state_new := cat(1, {y}, memory);
    annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = y_p - 2 E(u_p, u) falling, y_p + 2 E(u, u_p) rising.</p>
<p><b>Source:</b> Mayergoyz 1991, chapter 1; Everett 1955.</p>
<p><b>Limitations:</b> an inverse exists only if E increases on its diagonal.</p>
</html>"));
  end step;

  annotation (Documentation(info = "<html>
<p>values = cat(1, {lo, hi, Functions.preisachOrigin(lo, hi, start)}, Functions.virginBranch(n, E, offset, start), E); state0 = cat(1, {0, 0, 0, Functions.preisachOrigin(lo, hi, start)}, zeros(2*depth)).</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.Preisach\">Operators.Sampled.Preisach</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.ImplicitInverse\">Inverse.Sampled.ImplicitInverse</a>.</p>
</html>"));
end Preisach;
