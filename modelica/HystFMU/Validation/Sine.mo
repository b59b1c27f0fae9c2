within HystFMU.Validation;
model Sine "Sine reference with a preview"
  extends Icons.Example;
  Sources.Sine tested(amplitude = 1.5, offset = 0.2, frequency = 3, phase = 0.4, lead = 0.01);
  annotation (
    experiment(StopTime = 1.0, Interval = 1e-2, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Sine reference with a preview; the test holds it against the unit reference with shape sine.</p>
</html>"));
end Sine;
