within HystFMU.Functions;
function kernel "Krasnosel'skii-Pokrovskii kernels after a new input"
  extends Icons.Function;
  input Real u "New input";
  input Real a "Rise length of the ridge function";
  input Real p1[:] "Inputs at which the falling ramps reach -1";
  input Real p2[size(p1, 1)] "Inputs at which the rising ramps leave -1";
  input Real k[size(p1, 1)] "Last kernels";
  output Real k_new[size(p1, 1)] "New kernels";
algorithm
  for i in 1:size(p1, 1) loop
    k_new[i] := min(max(k[i], min(max(2*(u - p2[i])/a - 1, -1), 1)), min(max(2*(u - p1[i])/a - 1, -1), 1));
  end for;
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> k+ = min(max(k, ridge(u - p2)), ridge(u - p1)), ridge(x) = min(max(2 x/a - 1, -1), 1).</p>
<p><b>Source:</b> Krasnosel'skii &amp; Pokrovskii 1989, chapter 2.</p>
<p><b>Limitations:</b> p1 &le; p2.</p>
<p><b>Example:</b> <code>kernel(u, a, p1, p2, k0)</code> in <a href=\"modelica://HystFMU.Operators.Smooth.KrasnoselskiiPokrovskii\">Operators.Smooth.KrasnoselskiiPokrovskii</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Events.KrasnoselskiiPokrovskii\">Operators.Events.KrasnoselskiiPokrovskii</a>, <a href=\"modelica://HystFMU.Operators.Sampled.KrasnoselskiiPokrovskii\">Operators.Sampled.KrasnoselskiiPokrovskii</a>, <a href=\"modelica://HystFMU.Operators.Smooth.KrasnoselskiiPokrovskii\">Operators.Smooth.KrasnoselskiiPokrovskii</a>, which use it.</p>
</html>"));
end kernel;
