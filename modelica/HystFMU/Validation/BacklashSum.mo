within HystFMU.Validation;
model BacklashSum "Ten plays and a linear term on nested loops with plateaus"
  extends Icons.Example;
  Plants.BacklashSum tested(n = 10, w0 = 3, r = linspace(0.05, 0.5, 10), w = fill(1.0, 10), z0 = linspace(-0.2, 0.2, 10), Ts = 1e-3);
equation
  tested.u = max(-0.7, min(0.7, 0.2 + exp(-1.5*time)*sin(50*time) + 0.3*sin(12.1*time)*cos(3.3*time)));
  annotation (
    experiment(StopTime = 1.0, Interval = 0.001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Ten plays and a linear term on nested loops with plateaus; the test holds it against the unit of the same name at every sample.</p>
</html>"));
end BacklashSum;
