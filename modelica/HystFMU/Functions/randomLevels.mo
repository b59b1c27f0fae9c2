within HystFMU.Functions;
function randomLevels "Levels of random reversals"
  extends Icons.Function;
  input Integer seed "Seed";
  input Integer m "Number of reversals";
  output Real levels[m + 1] "0, then alternately above and below the last level, within -1 and 1";
algorithm
  levels[1] := 0;
  for k in 1:m loop
    levels[k + 1] := levels[k] + ((if mod(k, 2) == 1 then 1 else -1) - levels[k])*randomUniform(seed, k - 1);
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> l_(k+1) = l_k + (+-1 - l_k) U_k.</p>
<p><b>Source:</b> SplitMix64: Steele, Lea &amp; Flood 2014.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>randomLevels(seed, m)</code> in <a href=\"modelica://HystFMU.Sources.RandomReversals\">Sources.RandomReversals</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.RandomReversals\">Sources.RandomReversals</a>, which uses it.</p>
</html>"));
end randomLevels;
