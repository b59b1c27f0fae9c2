// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation.Sampled;
model ZhaoTanInverseReconstructed "Reconstructed inverse of the Zhao-Tan operator, sampled"
  extends Icons.Example;
  Inverse.Sampled.ZhaoTanInverseReconstructed tested(depth = 32, x0 = 0.1, Ts = 0.002) annotation (Placement(transformation(extent = {{10, -20}, {50, 20}})));
  BaseClasses.TestSignal signal(amplitude = 0.7, offset = 0) annotation (Placement(transformation(extent = {{-70, -20}, {-30, 20}})));
equation
  connect(signal.r, tested.h) annotation (Line(points = {{-28, 0}, {8, 0}}, color = {0, 0, 127}));
  annotation (experiment(StopTime = 1.4, Interval = 0.002, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Reconstructed inverse of the Zhao-Tan operator. The test compares it with the unit on the signal of <a href=\"modelica://HystFMU.Validation.BaseClasses.TestSignal\">Validation.BaseClasses.TestSignal</a>, at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Sampled.ZhaoTanInverseReconstructed\">Inverse.Sampled.ZhaoTanInverseReconstructed</a>.</p>
</html>"));
end ZhaoTanInverseReconstructed;
