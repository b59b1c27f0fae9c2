within HystFMU.Functions;
function kernelStart "Krasnosel'skii-Pokrovskii kernels on a grid before the first input"
  extends Icons.Function;
  input Integer n "Points of the grid";
  input Real lo "Lower end of the grid";
  input Real hi "Upper end of the grid";
  input Real u0 "Input that the memory starts from";
  output Real k0[div(n*(n + 1), 2)] "Each kernel as the middle of its ramps is at u0";
protected
  Real p1[div(n*(n + 1), 2)] = kernelGrid(n, lo, hi, false) "Where the falling ramps are -1";
  Real p2[div(n*(n + 1), 2)] = kernelGrid(n, lo, hi, true) "Where the rising ramps leave -1";
algorithm
  k0 := kernel(u0, (hi - lo)/n, 0.5*(p1 + p2), 0.5*(p1 + p2), fill(0, div(n*(n + 1), 2)));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> k0 = ridge(u0 - (p1 + p2)/2): as after ever smaller loops around u0.</p>
<p><b>Source:</b> Krasnosel'skii &amp; Pokrovskii 1989, chapter 2.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>kernelStart(n, lo, hi, u0)</code> in <a href=\"modelica://HystFMU.Operators.Sampled.KrasnoselskiiPokrovskii\">Operators.Sampled.KrasnoselskiiPokrovskii</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Events.KrasnoselskiiPokrovskii\">Operators.Events.KrasnoselskiiPokrovskii</a>, <a href=\"modelica://HystFMU.Operators.Sampled.KrasnoselskiiPokrovskii\">Operators.Sampled.KrasnoselskiiPokrovskii</a>, <a href=\"modelica://HystFMU.Operators.Smooth.KrasnoselskiiPokrovskii\">Operators.Smooth.KrasnoselskiiPokrovskii</a>, which use it.</p>
</html>"));
end kernelStart;
