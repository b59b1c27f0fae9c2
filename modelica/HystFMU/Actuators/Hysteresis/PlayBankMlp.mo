within HystFMU.Actuators.Hysteresis;
model PlayBankMlp "Network on the outputs of plays; passivity not proven"
  extends BaseClasses.Hysteresis(final passive = false, final y_start = offset + scale*(b2 + sum(k)*x_start + W2*Functions.activation(b1 + W1*fill(x_start, n + 1), activation)));
  extends Icons.Smooth;
  parameter Integer n(min = 1) = 4 "Number of plays" annotation (Dialog(group = "Sizes"));
  parameter Integer n_hidden(min = 1) = 2 "Number of hidden neurons" annotation (Dialog(group = "Sizes"));
  parameter Real r[n](each min = 0) = linspace(0.1, 0.4, n) "Half-widths of the plays in scaled voltage" annotation (Dialog(group = "Parameters"));
  parameter Real k[n + 1] = fill(0.2, n + 1) "Linear weights of scaled voltage and plays" annotation (Dialog(group = "Parameters"));
  parameter Real W1[n_hidden, n + 1] = fill(0.1, n_hidden, n + 1) "Hidden weights of scaled voltage and plays, one row per neuron" annotation (Dialog(group = "Parameters"));
  parameter Real b1[n_hidden] = fill(0.0, n_hidden) "Hidden biases" annotation (Dialog(group = "Parameters"));
  parameter Real W2[n_hidden] = fill(0.1, n_hidden) "Output weights" annotation (Dialog(group = "Parameters"));
  parameter Real b2 = 0 "Output bias" annotation (Dialog(group = "Parameters"));
  parameter Types.Activation activation = Types.Activation.tanh "Activation of the hidden neurons" annotation (Dialog(group = "Parameters"));
  parameter Real width(min = 0) = 1e-3*max(max(r), 1e-300) "Width of the rounded corner of a play in scaled voltage, greater than 0" annotation (Dialog(tab = "Advanced"));
protected
  Real z[n] "Plays";
  Real dz[n](each unit = "1/s") "Rates of z";
  Real f[n_hidden] "Weighted sums";
  Real df[n_hidden](each unit = "1/s") "Rates of f";
initial equation
  z = Functions.play(x, r, fill(x_start, n));
equation
  for i in 1:n loop
    dz[i] = Functions.playRate(x, dx, r[i], z[i], width);
    der(z[i]) = dz[i];
  end for;
  f = b1 + W1*cat(1, {x}, z);
  df = W1*cat(1, {dx}, dz);
  s = b2 + k*cat(1, {x}, z) + W2*Functions.activation(f, activation);
  ds = k*cat(1, {dx}, dz) + sum(W2[i]*df[i]*Functions.activationSlope(f[i], activation) for i in 1:n_hidden);
  y_rest = y_start;
  kept = shift*s;
  lost = (x - shift)*ds;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> s = b2 + k (x, z) + W2 f(b1 + W1 (x, z)), z the plays of x, f the activation.</p>
<p><b>Heat:</b> heat is the whole power; its sign changes within a cycle. No condition on the weights makes the network passive: a closed cycle may generate energy, and the actuator warns of this.</p>
<p><b>Source:</b> networks on plays: Visone, Serpico, Mayergoyz et al. 1998; the kind play_bank_mlp of HystFMU.</p>
<p><b>Limitations:</b> far outside the range of the training data, the output of a network is meaningless.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.StackMovesMass\">Examples.StackMovesMass</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.BaseClasses.Hysteresis\">Actuators.BaseClasses.Hysteresis</a>, <a href=\"modelica://HystFMU.Operators.Smooth.PlayBank\">Operators.Smooth.PlayBank</a>, <a href=\"modelica://HystFMU.Networks.Mlp\">Networks.Mlp</a>, <a href=\"modelica://HystFMU.Actuators.Hysteresis.PrandtlIshlinskii\">Actuators.Hysteresis.PrandtlIshlinskii</a>, <a href=\"modelica://HystFMU.Actuators.Hysteresis.BentPrandtlIshlinskii\">Actuators.Hysteresis.BentPrandtlIshlinskii</a>, <a href=\"modelica://HystFMU.Actuators.Hysteresis.Preisach\">Actuators.Hysteresis.Preisach</a>, <a href=\"modelica://HystFMU.Actuators.Hysteresis.KrasnoselskiiPokrovskii\">Actuators.Hysteresis.KrasnoselskiiPokrovskii</a>.</p>
</html>"));
end PlayBankMlp;
