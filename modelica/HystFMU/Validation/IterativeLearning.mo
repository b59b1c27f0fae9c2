// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model IterativeLearning "Iterative learning over three periods, with lead, filter and limits"
  extends Icons.Example;
  Control.IterativeLearning tested(n = 100, gain = 0.6, lead = 7, smooth = 0.1, u_min = -0.9, u_max = 0.8, Ts = 1e-3) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.y_d = sin(62.83185307179586*time);
  tested.y = 0.9*sin(62.83185307179586*time - 0.1) + 0.05;
  tested.u_ff = 1.1*sin(62.83185307179586*time);
  annotation (experiment(StopTime = 0.35, Interval = 0.001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Iterative learning over three periods, with lead, filter and limits. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.IterativeLearning\">Control.IterativeLearning</a>.</p>
</html>"));
end IterativeLearning;
