// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model BoucWenOscillator "Benchmark plant driven by two tones"
  extends Icons.Example;
  Plants.BoucWenOscillator tested annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.u = 120*sin(190*time) + 30*sin(410*time);
  annotation (experiment(StopTime = 0.1, Interval = 1e-05, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Benchmark plant driven by two tones. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Plants.BoucWenOscillator\">Plants.BoucWenOscillator</a>.</p>
</html>"));
end BoucWenOscillator;
