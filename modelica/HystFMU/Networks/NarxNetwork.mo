within HystFMU.Networks;
block NarxNetwork "NARX network: one hidden layer with lags of input and output"
  extends BaseClasses.NarxNetwork(y(start = y0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real past_u[n_u](each start = 0, each fixed = true) "u_k and older inputs, newest first";
  discrete Real past_y[max(n_y, 1)](each start = 0, each fixed = true) "y_(k-1) and older outputs, newest first";
  discrete Real z[n_u + n_y](each start = 0, each fixed = true) "Lags of input and output";
equation
  when sample(t0, Ts) then
    past_u = if not pre(begun) then fill(u, n_u) else Functions.shift(u, pre(past_u));
    past_y = if not pre(begun) then fill(y0, max(n_y, 1)) else Functions.shift(pre(y), pre(past_y));
    z = cat(1, past_u, Functions.lagged(past_y, 0, n_y));
    y = b2 + a*z + W2*Functions.activation(Functions.neurons(z, W1, b1), Types.Activation.tanh);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> far outside the range of the training data, the output of a network is meaningless.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Networks.BaseClasses.NarxNetwork\">Networks.BaseClasses.NarxNetwork</a>: equation, source, example.</p>
</html>"));
end NarxNetwork;
