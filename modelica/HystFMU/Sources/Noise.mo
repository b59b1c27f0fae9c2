within HystFMU.Sources;
block Noise "White Gaussian noise"
  extends BaseClasses.Noise(w(start = 0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real counter(start = -1, fixed = true) "Index of the step";
equation
  when sample(t0, Ts) then
    counter = pre(counter) + 1;
    w = sigma*Functions.randomNormal(seed, counter);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> the output has one value per sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.BaseClasses.Noise\">Sources.BaseClasses.Noise</a>: equation, source, example.</p>
</html>"));
end Noise;
