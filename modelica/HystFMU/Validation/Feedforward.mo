within HystFMU.Validation;
model Feedforward "Feed-forward of a sine"
  extends Icons.Example;
  Control.Feedforward tested(f_n = 40, zeta = 0.3, gain = 2);
equation
  tested.r = sin(20*time);
  tested.dr = 20*cos(20*time);
  tested.ddr = -400*sin(20*time);
  annotation (
    experiment(StopTime = 1.0, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Feed-forward of a sine; the test holds it against the unit of the same name at every sample.</p>
</html>"));
end Feedforward;
