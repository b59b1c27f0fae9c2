// generated from the table of fmu_build/core/blocks/sources/noise.c by `make generate` - do not edit
within HystFMU.Sources.BaseClasses;
partial block Noise "White Gaussian noise: parameters and ports"
  extends Icons.Source;
  parameter Real sigma(min = 0) = 1 "Standard deviation" annotation (Dialog(group = "Signal"));
  parameter Integer seed(min = 0, max = 2147483647) = 1 "Seed" annotation (Dialog(group = "Signal"));
  Interfaces.RealOutput w "Noise" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> w_k = sigma N(0, 1), by (seed, k).</p>
<p><b>Source:</b> SplitMix64: Steele, Lea &amp; Flood 2014; Box &amp; Muller 1958.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Noise\">Validation.Noise</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.Noise\">Sources.Noise</a>.</p>
</html>"));
end Noise;
