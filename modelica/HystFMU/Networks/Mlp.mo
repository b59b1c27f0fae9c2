within HystFMU.Networks;
block Mlp "Multilayer perceptron: one hidden layer, linear outputs"
  extends BaseClasses.Mlp;
equation
  y = b2 + W2*Functions.activation(b1 + W1*u, activation);
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> no memory; far outside the range of the training data, the output of a network is meaningless.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Networks.BaseClasses.Mlp\">Networks.BaseClasses.Mlp</a>: equation, source, example.</p>
</html>"));
end Mlp;
