within HystFMU.Validation;
model PrandtlIshlinskii "Prandtl-Ishlinskii operator on nested loops with plateaus; the memory is so short that it forgets"
  extends Icons.Example;
  Operators.PrandtlIshlinskii tested(n = 5, depth = 4, w0 = 0.4, r = {0.02, 0.05, 0.1, 0.2, 0.4}, w = {0.3, -0.1, 0.5, 0.2, 0.7}, u0 = 0.1, Ts = 1e-3);
equation
  tested.u = max(-0.7, min(0.7, 0.2 + exp(-1.5*time)*sin(50*time) + 0.3*sin(12.1*time)*cos(3.3*time)));
  annotation (
    experiment(StopTime = 1.0, Interval = 0.001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Prandtl-Ishlinskii operator on nested loops with plateaus; the memory is so short that it forgets; the test holds it against the unit of the same name at every sample.</p>
</html>"));
end PrandtlIshlinskii;
