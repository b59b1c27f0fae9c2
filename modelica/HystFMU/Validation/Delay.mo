within HystFMU.Validation;
model Delay "Delay by three steps"
  extends Icons.Example;
  Dynamics.Delay tested(n = 3, y0 = 0.5, Ts = 1e-2);
equation
  tested.u = sin(7*time) + time;
  annotation (
    experiment(StopTime = 1.0, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Delay by three steps; the test holds it against the unit of the same name at every sample.</p>
</html>"));
end Delay;
