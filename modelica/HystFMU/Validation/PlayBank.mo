within HystFMU.Validation;
model PlayBank "Bank of three plays on nested loops with plateaus"
  extends Icons.Example;
  Operators.PlayBank tested(n = 3, r = {0, 0.1, 0.3}, z0 = {0.1, 0, -0.4}, Ts = 1e-3);
equation
  tested.u = max(-0.7, min(0.7, 0.2 + exp(-1.5*time)*sin(50*time) + 0.3*sin(12.1*time)*cos(3.3*time)));
  annotation (
    experiment(StopTime = 1.0, Interval = 0.001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Bank of three plays on nested loops with plateaus; the test holds it against the unit of the same name at every sample.</p>
</html>"));
end PlayBank;
