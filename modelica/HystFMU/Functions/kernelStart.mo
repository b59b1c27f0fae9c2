within HystFMU.Functions;
function kernelStart "Krasnosel'skii-Pokrovskii kernels on a grid before the first input"
  extends Icons.Function;
  input Integer n "Number of grid points";
  input Real lo "Lower end of the grid";
  input Real hi "Upper end of the grid";
  input Real u0 "Initial input of the memory";
  output Real k0[div(n*(n + 1), 2)] "Kernels; each has the mean of its two ramps at u0";
protected
  Real p1[div(n*(n + 1), 2)] = kernelGrid(n, lo, hi, false) "Inputs at which the falling ramps reach -1";
  Real p2[div(n*(n + 1), 2)] = kernelGrid(n, lo, hi, true) "Inputs at which the rising ramps leave -1";
algorithm
  k0 := kernel(u0, (hi - lo)/n, 0.5*(p1 + p2), 0.5*(p1 + p2), fill(0, div(n*(n + 1), 2)));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> k0 = ridge(u0 - (p1 + p2)/2), the value after loops of decreasing size around u0.</p>
<p><b>Source:</b> Krasnosel'skii &amp; Pokrovskii 1989, chapter 2.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>kernelStart(n, lo, hi, u0)</code> in <a href=\"modelica://HystFMU.Operators.Sampled.KrasnoselskiiPokrovskii\">Operators.Sampled.KrasnoselskiiPokrovskii</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Events.KrasnoselskiiPokrovskii\">Operators.Events.KrasnoselskiiPokrovskii</a>, <a href=\"modelica://HystFMU.Operators.Sampled.KrasnoselskiiPokrovskii\">Operators.Sampled.KrasnoselskiiPokrovskii</a>, <a href=\"modelica://HystFMU.Operators.Smooth.KrasnoselskiiPokrovskii\">Operators.Smooth.KrasnoselskiiPokrovskii</a>, which use it.</p>
</html>"));
end kernelStart;
