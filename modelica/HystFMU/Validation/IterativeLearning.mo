within HystFMU.Validation;
model IterativeLearning "Iterative learning over three periods, with lead, filter and limits"
  extends Icons.Example;
  Control.IterativeLearning tested(n = 100, gain = 0.6, lead = 7, smooth = 0.1, u_min = -0.9, u_max = 0.8, Ts = 1e-3);
equation
  tested.y_d = sin(62.83185307179586*time);
  tested.y = 0.9*sin(62.83185307179586*time - 0.1) + 0.05;
  tested.u_ff = 1.1*sin(62.83185307179586*time);
  annotation (
    experiment(StopTime = 0.35, Interval = 0.001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Iterative learning over three periods, with lead, filter and limits; the test holds it against the unit of the same name at every sample.</p>
</html>"));
end IterativeLearning;
