// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model BacklashSumDynamics "Ten plays and a linear term before dynamics of 500 Hz, default values"
  extends Icons.Example;
  Plants.BacklashSumDynamics tested(Ts = 1e-4) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.u = 0.1 + (0.2 + exp(-8*time))*sin(400*time);
  annotation (experiment(StopTime = 0.2, Interval = 0.0001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Ten plays and a linear term before dynamics of 500 Hz, default values. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Plants.BacklashSumDynamics\">Plants.BacklashSumDynamics</a>.</p>
</html>"));
end BacklashSumDynamics;
