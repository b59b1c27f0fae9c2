// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model DuhemOscillator "Oscillator with a softening Duhem force, driven by two tones"
  extends Icons.Example;
  Plants.DuhemOscillator tested(n = 3, f = {9e4, 5e4, 2e4}, z_max = 80) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.u = 120*sin(190*time) + 30*sin(410*time);
  annotation (experiment(StopTime = 0.1, Interval = 1e-05, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Oscillator with a softening Duhem force, driven by two tones. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Plants.DuhemOscillator\">Plants.DuhemOscillator</a>.</p>
</html>"));
end DuhemOscillator;
