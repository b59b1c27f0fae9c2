// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model TransferFunctionSteady "Third-order dynamics with direct feed-through and ramps as input, from equilibrium"
  extends Icons.Example;
  Dynamics.TransferFunction tested(na = 3, nb = 3, b = {0.5, 300, 2e5, 6e8}, a = {2, 3000, 5e6, 1.5e9}, start = Types.Start.steady) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.u = 1.3 + 40*max(time - 0.01, 0) - 110*max(time - 0.02, 0) + 90*max(time - 0.025, 0);
  annotation (experiment(StopTime = 0.05, Interval = 0.0001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Third-order dynamics with direct feed-through and ramps as input, from equilibrium. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.TransferFunction\">Dynamics.TransferFunction</a>.</p>
</html>"));
end TransferFunctionSteady;
