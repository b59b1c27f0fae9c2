within HystFMU.Functions;
function randomNormal "Standard normal number by seed and counter"
  extends Icons.Function;
  input Integer seed "Seed";
  input Real k "Counter, a whole number";
  output Real r "Normal number";
algorithm
  r := sqrt(-2*log(1 - randomUniform(seed, 2*k)))*cos(6.283185307179586*randomUniform(seed, 2*k + 1));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> r = sqrt(-2 ln(1 - U_2k)) cos(2 pi U_(2k+1)).</p>
<p><b>Source:</b> Box &amp; Muller 1958.</p>
<p><b>Limitations:</b> as for randomUniform.</p>
<p><b>Example:</b> <code>randomNormal(seed, counter)</code> in <a href=\"modelica://HystFMU.Sources.Noise\">Sources.Noise</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.Noise\">Sources.Noise</a>, which uses it.</p>
</html>"));
end randomNormal;
