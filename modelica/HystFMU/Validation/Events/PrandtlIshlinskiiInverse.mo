// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation.Events;
model PrandtlIshlinskiiInverse "Inverse of a Prandtl-Ishlinskii operator, events"
  extends Icons.Example;
  Inverse.Events.PrandtlIshlinskiiInverse tested(n = 5, depth = 32, w0 = 0.4, r = {0.02, 0.05, 0.1, 0.2, 0.4}, w = {0.3, -0.1, 0.5, 0.2, 0.7}, u0 = 0.1) annotation (Placement(transformation(extent = {{10, -20}, {50, 20}})));
  BaseClasses.TestSignal signal(amplitude = 1.5, offset = 0.1) annotation (Placement(transformation(extent = {{-70, -20}, {-30, 20}})));
equation
  connect(signal.r, tested.y) annotation (Line(points = {{-28, 0}, {8, 0}}, color = {0, 0, 127}));
  connect(signal.dr, tested.dy) annotation (Line(points = {{-28, -14}, {8, -14}}, color = {0, 0, 127}));
  annotation (experiment(StopTime = 1.4, Interval = 0.002, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Inverse of a Prandtl-Ishlinskii operator. The test compares it with the unit on the signal of <a href=\"modelica://HystFMU.Validation.BaseClasses.TestSignal\">Validation.BaseClasses.TestSignal</a>, at every row of the simulation.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Events.PrandtlIshlinskiiInverse\">Inverse.Events.PrandtlIshlinskiiInverse</a>.</p>
</html>"));
end PrandtlIshlinskiiInverse;
