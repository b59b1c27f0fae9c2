within HystFMU.Validation;
model BacklashSumDynamics "Ten plays and a linear term before dynamics of 500 Hz, default values"
  extends Icons.Example;
  Plants.BacklashSumDynamics tested(Ts = 1e-4);
equation
  tested.u = 0.1 + (0.2 + exp(-8*time))*sin(400*time);
  annotation (
    experiment(StopTime = 0.2, Interval = 0.0001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Ten plays and a linear term before dynamics of 500 Hz, default values; the test holds it against the chain of the units backlash_sum and transfer_function.</p>
</html>"));
end BacklashSumDynamics;
