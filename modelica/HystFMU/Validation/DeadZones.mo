within HystFMU.Validation;
model DeadZones "Three dead zones"
  extends Icons.Example;
  Operators.DeadZones tested(n = 3, w0 = 0.8, r = {-0.2, 0, 0.3}, w = {0.4, 0.2, -0.5});
equation
  tested.u = sin(7*time);
  annotation (
    experiment(StopTime = 1.0, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Three dead zones; the test holds it against the unit of the same name at every sample.</p>
</html>"));
end DeadZones;
