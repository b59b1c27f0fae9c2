within HystFMU.Validation;
model BoucWenKnee "Bouc-Wen operator with a sharp knee"
  extends Icons.Example;
  Operators.BoucWen tested(A = 2, beta = 2.5, gamma = 0.8, n = 2.5, alpha = 0.3, Ts = 1e-3);
equation
  tested.u = max(-0.7, min(0.7, 0.2 + exp(-1.5*time)*sin(50*time) + 0.3*sin(12.1*time)*cos(3.3*time)));
  annotation (
    experiment(StopTime = 1.0, Interval = 0.001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Bouc-Wen operator with a sharp knee; the test holds it against the unit of the same name at every sample.</p>
</html>"));
end BoucWenKnee;
