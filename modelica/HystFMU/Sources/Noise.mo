within HystFMU.Sources;
block Noise "White Gaussian noise"
  extends Icons.Source;
  extends Interfaces.Sampled;
  parameter Real sigma(min = 0) = 1 "Standard deviation";
  parameter Integer seed(min = 0, max = 2147483647) = 1 "Seed";
  Interfaces.RealOutput w(start = 0, fixed = true) "Noise" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  discrete Real counter(start = -1, fixed = true) "Number of the step";
equation
  when sample(0, Ts) then
    counter = pre(counter) + 1;
    w = sigma*Functions.randomNormal(seed, counter);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> w_k = sigma N(0, 1), by (seed, k).</p>
<p><b>Source:</b> SplitMix64: Steele, Lea &amp; Flood 2014; Box &amp; Muller 1958. The same numbers as the unit <em>noise</em>.</p>
<p><b>Limitations:</b> one value for each sample; the simulation must start at time 0.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Noise\">Validation.Noise</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.Disturbance\">Sources.Disturbance</a>.</p>
</html>"));
end Noise;
