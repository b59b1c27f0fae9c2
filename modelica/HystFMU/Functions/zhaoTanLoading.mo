within HystFMU.Functions;
function zhaoTanLoading "Initial loading curve of the Zhao-Tan operator"
  extends Icons.Function;
  input Real q[:] "Inputs, at least 0";
  output Real phi[size(q, 1)] "Outputs";
algorithm
  for i in 1:size(q, 1) loop
    phi[i] := (1 + exp(-2*q[i]))*tanh(q[i])*q[i];
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> phi(q) = g(2 q)/2, g(d) = (1 - e<sup>-d</sup>) d.</p>
<p><b>Source:</b> Masing's rule; Zhao &amp; Tan 2008, eq. 4.</p>
<p><b>Limitations:</b> q &ge; 0.</p>
<p><b>Example:</b> <code>zhaoTanLoading(q)</code> in <a href=\"modelica://HystFMU.Operators.Smooth.ZhaoTan\">Operators.Smooth.ZhaoTan</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Smooth.ZhaoTan\">Operators.Smooth.ZhaoTan</a>, which uses it.</p>
</html>"));
end zhaoTanLoading;
