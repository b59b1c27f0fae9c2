// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model MaxwellSlipOscillator "Oscillator with Maxwell-slip friction, driven by two tones"
  extends Icons.Example;
  Plants.MaxwellSlipOscillator tested(n = 3, k = {5e4, 3e4, 1e4}, r = {2e-4, 5e-4, 2e-3}) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.u = 120*sin(190*time) + 30*sin(410*time);
  annotation (experiment(StopTime = 0.1, Interval = 1e-05, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Oscillator with Maxwell-slip friction, driven by two tones. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Plants.MaxwellSlipOscillator\">Plants.MaxwellSlipOscillator</a>.</p>
</html>"));
end MaxwellSlipOscillator;
