within HystFMU.Validation;
model TransferFunctionSteady "Third-order dynamics with direct feed-through and ramps as input, from equilibrium"
  extends Icons.Example;
  Dynamics.TransferFunction tested(na = 3, nb = 3, b = {0.5, 300, 2e5, 6e8}, a = {2, 3000, 5e6, 1.5e9}, start = Types.Start.steady);
equation
  tested.u = 1.3 + 40*max(time - 0.01, 0) - 110*max(time - 0.02, 0) + 90*max(time - 0.025, 0);
  annotation (
    experiment(StopTime = 0.05, Interval = 0.0001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Third-order dynamics with direct feed-through and ramps as input, from equilibrium; the test holds it against the unit of the same name with hold = foh.</p>
</html>"));
end TransferFunctionSteady;
