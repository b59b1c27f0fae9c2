within HystFMU.Validation.Sampled;
model ConstraintFactorInverse "Inverse of a constraint-factor operator, beyond d_max too, sampled"
  extends Icons.Example;
  Inverse.Sampled.ConstraintFactorInverse tested(m = 2, depth = 32, a0 = 0.5, a = {1, 0.05}, d_max = 1.5, x0 = -0.1, Ts = 2e-3) annotation (Placement(transformation(extent = {{10, -20}, {50, 20}})));
  BaseClasses.TestSignal signal(amplitude = 0.9, offset = 0) annotation (Placement(transformation(extent = {{-70, -20}, {-30, 20}})));
equation
  connect(signal.r, tested.h);
  annotation (experiment(StopTime = 1.4, Interval = 0.002, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Inverse of a constraint-factor operator, beyond d_max too. The test holds it against the unit of the same name and an independent form, on the signal of Validation.BaseClasses.TestSignal: at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Sampled.ConstraintFactorInverse\">Inverse.Sampled.ConstraintFactorInverse</a>.</p>
</html>"));
end ConstraintFactorInverse;
