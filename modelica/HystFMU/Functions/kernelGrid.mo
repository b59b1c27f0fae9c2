within HystFMU.Functions;
function kernelGrid "Inputs at which the ramps of Krasnosel'skii-Pokrovskii kernels begin"
  extends Icons.Function;
  input Integer n "Number of grid points";
  input Real lo "Lower end of the grid";
  input Real hi "Upper end of the grid";
  input Boolean rising "True: rising ramps; false: falling ramps";
  output Real p[div(n*(n + 1), 2)] "Inputs at which the ramps leave -1";
protected
  Integer k = 0 "Number of previous kernels";
algorithm
  p := fill(lo, div(n*(n + 1), 2));
  for i in 0:n - 1 loop
    for j in 0:i loop
      k := k + 1;
      p[k] := p[k] + (if rising then i else j)*(hi - lo)/n;
    end for;
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> p2 = lo + i a, p1 = lo + j a, a = (hi - lo)/n, for i = 0, .., n - 1 and j = 0, .., i.</p>
<p><b>Source:</b> Banks, Kurdila &amp; Webb 1997; Zhao &amp; Tan 2008, section V.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>kernelGrid(n, lo, hi, true)</code> in <a href=\"modelica://HystFMU.Operators.Sampled.KrasnoselskiiPokrovskii\">Operators.Sampled.KrasnoselskiiPokrovskii</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Events.KrasnoselskiiPokrovskii\">Operators.Events.KrasnoselskiiPokrovskii</a>, <a href=\"modelica://HystFMU.Operators.Sampled.KrasnoselskiiPokrovskii\">Operators.Sampled.KrasnoselskiiPokrovskii</a>, <a href=\"modelica://HystFMU.Operators.Smooth.KrasnoselskiiPokrovskii\">Operators.Smooth.KrasnoselskiiPokrovskii</a>, which use it.</p>
</html>"));
end kernelGrid;
