within HystFMU.Inverse.Models;
package Mlp "Multilayer perceptron as a static model"
  extends Icons.Package;

  function step "Outputs of the network at new inputs"
    extends Icons.Function;
    input Real u[:] "New inputs";
    input Real state[:] "Outputs and memory before";
    input Real values[:] "Parameters of the model";
    output Real state_new[size(state, 1)] "Outputs and memory after";
  protected
    Integer m = size(u, 1) "Number of inputs";
    Integer n = div(size(values, 1) - 1 - size(state, 1), size(u, 1) + 1 + size(state, 1)) "Number of hidden neurons";
    Types.Activation kind = if values[1] < 1.5 then Types.Activation.sigmoid elseif values[1] < 2.5 then Types.Activation.tanh else Types.Activation.relu "Activation";
    Real h "Output of a hidden neuron";
  algorithm
    for i in 1:size(state, 1) loop
      state_new[i] := values[1 + n*(m + 1 + size(state, 1)) + i];
    end for;
    for j in 1:n loop
      h := values[1 + n*m + j];
      for i in 1:m loop
        h := h + values[1 + (j - 1)*m + i]*u[i];
      end for;
      h := if kind == Types.Activation.sigmoid then 1/(1 + exp(-h)) elseif kind == Types.Activation.tanh then tanh(h) else max(h, 0);
      for i in 1:size(state, 1) loop
        state_new[i] := state_new[i] + values[1 + n*(m + i) + j]*h;
      end for;
    end for;
    annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = b2 + W2 f(b1 + W1 u), f the activation.</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, section IV.</p>
<p><b>Limitations:</b> none.</p>
</html>"));
  end step;

  annotation (Documentation(info = "<html>
<p>The vector holds the matrices row by row: values = cat(1, {Integer(activation)}, W1, b1, W2, b2); state0 = zeros(n_out).</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Networks.Mlp\">Networks.Mlp</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.ImplicitInverse\">Inverse.Sampled.ImplicitInverse</a>.</p>
</html>"));
end Mlp;
