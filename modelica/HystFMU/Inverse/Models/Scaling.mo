within HystFMU.Inverse.Models;
package Scaling "Limits, gains and offsets as a static model"
  extends Icons.Package;

  function step "Outputs at new inputs"
    extends Icons.Function;
    input Real u[:] "New inputs";
    input Real state[:] "Outputs and memory before";
    input Real values[:] "Parameters of the model";
    output Real state_new[size(state, 1)] "Outputs and memory after";
  protected
    Integer n = size(u, 1) "Number of signals";
  algorithm
    for i in 1:n loop
      state_new[i] := min(values[3*n + i], max(values[2*n + i], u[i]))*values[i] + values[n + i];
    end for;
    annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = gain min(hi, max(lo, u)) + offset.</p>
<p><b>Source:</b> definition.</p>
<p><b>Limitations:</b> none.</p>
</html>"));
  end step;

  annotation (Documentation(info = "<html>
<p>values = cat(1, gain, offset, lo, hi); state0 = zeros(n).</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.Scaling\">Dynamics.Scaling</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.ImplicitInverse\">Inverse.Sampled.ImplicitInverse</a>.</p>
</html>"));
end Scaling;
