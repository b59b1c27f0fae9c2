within HystFMU.Inverse.Models;
package PlayBank "Plays side by side as a static model"
  extends Icons.Package;

  function step "Plays after a new input"
    extends Icons.Function;
    input Real u "New input";
    input Real state[:] "Outputs and memory before";
    input Real values[:] "Parameters of the model";
    output Real state_new[size(state, 1)] "Outputs and memory after";
  algorithm
    state_new := Functions.play(u, values, state);
    annotation (Documentation(info = "<html>
<p><b>Equation:</b> z+ = max(u - r, min(u + r, z)).</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 3.</p>
<p><b>Limitations:</b> the outputs are vectors: another block must follow.</p>
</html>"));
  end step;

  annotation (Documentation(info = "<html>
<p>values = r; state0 = z0.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.PlayBank\">Operators.Sampled.PlayBank</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.ImplicitInverse\">Inverse.Sampled.ImplicitInverse</a>.</p>
</html>"));
end PlayBank;
