// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model DeadZones "Three dead zones"
  extends Icons.Example;
  Operators.DeadZones tested(n = 3, w0 = 0.8, r = {-0.2, 0, 0.3}, w = {0.4, 0.2, -0.5}) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.u = sin(7*time);
  annotation (experiment(StopTime = 1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Three dead zones. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.DeadZones\">Operators.DeadZones</a>.</p>
</html>"));
end DeadZones;
