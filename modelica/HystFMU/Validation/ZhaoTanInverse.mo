within HystFMU.Validation;
model ZhaoTanInverse "Inverse Zhao-Tan operator on nested loops with plateaus; the memory is so short that it forgets"
  extends Icons.Example;
  Inverse.ZhaoTanInverse tested(depth = 4, x0 = 0.1, Ts = 1e-3);
equation
  tested.h = 4*max(-0.7, min(0.7, 0.2 + exp(-1.5*time)*sin(50*time) + 0.3*sin(12.1*time)*cos(3.3*time)));
  annotation (
    experiment(StopTime = 1.0, Interval = 0.001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Inverse Zhao-Tan operator on nested loops with plateaus; the memory is so short that it forgets; the test holds it against the unit of the same name at every sample.</p>
</html>"));
end ZhaoTanInverse;
