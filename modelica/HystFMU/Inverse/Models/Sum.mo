within HystFMU.Inverse.Models;
package Sum "Weighted sum as a static model"
  extends Icons.Package;

  function step "Weighted sum of new inputs"
    extends Icons.Function;
    input Real u[:] "New inputs";
    input Real state[:] "Outputs and memory before";
    input Real values[:] "Parameters of the model";
    output Real state_new[size(state, 1)] "Outputs and memory after";
  algorithm
    state_new := {values[1] + values[2:size(values, 1)]*u};
    annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = offset + sum_i k_i u_i.</p>
<p><b>Source:</b> definition.</p>
<p><b>Limitations:</b> none.</p>
</html>"));
  end step;

  annotation (Documentation(info = "<html>
<p>values = cat(1, {offset}, k); state0 = {0}.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.Sum\">Dynamics.Sum</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.ImplicitInverse\">Inverse.Sampled.ImplicitInverse</a>.</p>
</html>"));
end Sum;
