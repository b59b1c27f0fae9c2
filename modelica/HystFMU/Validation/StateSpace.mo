// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model StateSpace "Lag of 0.05 s, discretised for 0.01 s"
  extends Icons.Example;
  Dynamics.StateSpace tested(n = 1, A = [0.8187307530779818], b_new = {0.1812692469220182}, Ts = 0.01) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.u = sin(7*time);
  annotation (experiment(StopTime = 1.1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Lag of 0.05 s, discretised for 0.01 s. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.StateSpace\">Dynamics.StateSpace</a>.</p>
</html>"));
end StateSpace;
