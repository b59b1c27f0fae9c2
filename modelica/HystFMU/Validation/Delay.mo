// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model Delay "Delay by three steps"
  extends Icons.Example;
  Dynamics.Delay tested(n = 3, y0 = 0.5, Ts = 1e-2) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.u = sin(7*time) + time;
  annotation (experiment(StopTime = 1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Delay by three steps. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.Delay\">Dynamics.Delay</a>.</p>
</html>"));
end Delay;
