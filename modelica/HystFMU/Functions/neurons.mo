within HystFMU.Functions;
function neurons "Weighted sums of the neurons of a layer"
  extends Icons.Function;
  input Real z[:] "Inputs of the layer";
  input Real W[:] "Weights, one row per neuron";
  input Real b[:] "Biases";
  output Real s[size(b, 1)] "Weighted sums";
algorithm
  for i in 1:size(b, 1) loop
    s[i] := b[i];
    for j in 1:size(z, 1) loop
      s[i] := s[i] + W[(i - 1)*size(z, 1) + j]*z[j];
    end for;
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> s_i = b_i + sum over j of W_((i-1) n + j) z_j.</p>
<p><b>Source:</b> definition.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>neurons(z, W1, b1)</code> in <a href=\"modelica://HystFMU.Networks.NarxNetwork\">Networks.NarxNetwork</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Networks.NarxNetwork\">Networks.NarxNetwork</a>, which uses it; <a href=\"modelica://HystFMU.Functions.activation\">activation</a>.</p>
</html>"));
end neurons;
