within HystFMU.Functions;
function randomUniform "Uniform number in [0, 1) by seed and counter"
  extends Icons.Function;
  input Integer seed "Seed";
  input Real k "Counter, a whole number";
  output Real r "Uniform number, 53 bits";
protected
  Real z[4];
algorithm
  z := multiply64({mod(k + 1, 65536), mod(floor((k + 1)/65536), 65536), mod(floor((k + 1)/4294967296), 65536), 0}, {31765, 32586, 31161, 40503});
  z[1] := z[1] + mod(seed, 65536);
  z[2] := z[2] + div(seed, 65536) + floor(z[1]/65536);
  z[1] := mod(z[1], 65536);
  z[3] := z[3] + floor(z[2]/65536);
  z[2] := mod(z[2], 65536);
  z[4] := mod(z[4] + floor(z[3]/65536), 65536);
  z[3] := mod(z[3], 65536);
  z := multiply64(xorShift64(z, 30), {58809, 7396, 18285, 48984});
  z := multiply64(xorShift64(z, 27), {4587, 4913, 18875, 38096});
  z := xorShift64(z, 31);
  r := (z[4]*137438953472 + z[3]*2097152 + z[2]*32 + floor(z[1]/2048))/9007199254740992;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> hash of seed + (k + 1) gamma by two multiplications and three shifts.</p>
<p><b>Source:</b> SplitMix64: Steele, Lea &amp; Flood, OOPSLA 2014, figure 16.</p>
<p><b>Limitations:</b> seed &lt; 2<sup>31</sup>, k &lt; 2<sup>48</sup>.</p>
<p><b>Example:</b> <code>randomUniform(seed, 2*k)</code> in <a href=\"modelica://HystFMU.Functions.randomNormal\">Functions.randomNormal</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.randomLevels\">Functions.randomLevels</a>, <a href=\"modelica://HystFMU.Functions.randomNormal\">Functions.randomNormal</a>, which use it.</p>
</html>"));
end randomUniform;
