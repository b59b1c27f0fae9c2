within HystFMU.Functions;
function activation "Activation of a layer"
  extends Icons.Function;
  input Real s[:] "Weighted sums";
  input Types.Activation kind "Activation";
  output Real a[size(s, 1)] "Activated values";
algorithm
  for i in 1:size(s, 1) loop
    a[i] := if kind == Types.Activation.sigmoid then 1/(1 + exp(-s[i])) elseif kind == Types.Activation.tanh then tanh(s[i]) else max(s[i], 0);
  end for;
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> a_i = 1/(1 + e<sup>-s_i</sup>), tanh(s_i) or max(s_i, 0).</p>
<p><b>Source:</b> the usual definitions.</p>
<p><b>Limitation:</b> the sigmoid needs s_i &gt; -700.</p>
<p><b>Example:</b> <code>activation(b1 + W1*u, activation)</code> in <a href=\"modelica://HystFMU.Networks.Mlp\">Networks.Mlp</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Networks.Mlp\">Networks.Mlp</a>, which uses it.</p>
</html>"));
end activation;
