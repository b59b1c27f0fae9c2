within HystFMU.Inverse.Models;
package KrasnoselskiiPokrovskii "Krasnosel'skii-Pokrovskii operator as a static model"
  extends BaseClasses.StaticModel;

  redeclare function extends step "Krasnosel'skii-Pokrovskii operator after a new input"
  protected
    Integer n = div(size(values, 1) - 2, 3) "Number of kernels";
    Real k[div(size(values, 1) - 2, 3)] = Functions.kernel(u, values[1], values[3:n + 2], values[n + 3:2*n + 2], state[2:n + 1]) "Kernels";
  algorithm
    state_new := cat(1, {values[2] + values[2*n + 3:3*n + 2]*k}, k);
    annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = offset + sum_i w_i k_i.</p>
<p><b>Source:</b> Krasnosel'skii &amp; Pokrovskii 1989.</p>
<p><b>Limitations:</b> after a reversal, the kernels do not change at first; while no kernel changes, the inverse keeps the last input.</p>
</html>"));
  end step;

  annotation (Documentation(info = "<html>
<p>values = cat(1, {(hi - lo)/n, offset}, Functions.kernelGrid(n, lo, hi, false), Functions.kernelGrid(n, lo, hi, true), w); state0 = cat(1, {0}, Functions.kernelStart(n, lo, hi, u0)).</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.KrasnoselskiiPokrovskii\">Operators.Sampled.KrasnoselskiiPokrovskii</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.ImplicitInverse\">Inverse.Sampled.ImplicitInverse</a>.</p>
</html>"));
end KrasnoselskiiPokrovskii;
