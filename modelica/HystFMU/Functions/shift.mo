within HystFMU.Functions;
function shift "Shift register after a new input"
  extends Icons.Function;
  input Real u "New input";
  input Real inputs[:] "The last inputs, newest first";
  output Real inputs_new[size(inputs, 1)] "Inputs with the new input, without the oldest input";
algorithm
  inputs_new[1] := u;
  for i in 2:size(inputs, 1) loop
    inputs_new[i] := inputs[i - 1];
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> new_1 = u, new_i = old_(i-1).</p>
<p><b>Source:</b> definition.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>shift(u, pre(inputs))</code> in <a href=\"modelica://HystFMU.Dynamics.Delay\">Dynamics.Delay</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.Delay\">Dynamics.Delay</a>, <a href=\"modelica://HystFMU.Networks.PolynomialNarx\">Networks.PolynomialNarx</a>, <a href=\"modelica://HystFMU.Control.Repetitive\">Control.Repetitive</a>, <a href=\"modelica://HystFMU.Inverse.AdaptiveInverse\">Inverse.AdaptiveInverse</a>, which use it.</p>
</html>"));
end shift;
