within HystFMU.Validation;
model Sum "Weighted sum of three signals"
  extends Icons.Example;
  Dynamics.Sum tested(n = 3, k = {1, -2, 0.5}, offset = 0.3);
equation
  tested.u[1] = sin(7*time);
  tested.u[2] = cos(5*time);
  tested.u[3] = time;
  annotation (
    experiment(StopTime = 1.0, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Weighted sum of three signals; the test holds it against the unit of the same name at every sample.</p>
</html>"));
end Sum;
