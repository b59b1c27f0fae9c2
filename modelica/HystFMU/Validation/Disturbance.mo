within HystFMU.Validation;
model Disturbance "Step plus sine"
  extends Icons.Example;
  Sources.Disturbance tested(step = 0.5, t_step = 0.305, amplitude = 0.2, frequency = 3, phase = 0.4);
  annotation (
    experiment(StopTime = 1.0, Interval = 1e-2, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Step plus sine; the test holds it against the unit of the same name at every sample.</p>
</html>"));
end Disturbance;
