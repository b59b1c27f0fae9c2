// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model ModifiedBoucWen "Damper with a sharp knee whose piston moves to and fro"
  extends Icons.Example;
  Dynamics.ModifiedBoucWen tested(c_0 = 0.2, c_1 = 3, k_0 = 0.5, k_1 = 0.1, x_0 = 0.05, alpha = 20, A = 1.5, beta = 10, gamma = 30, n = 1.7, z0 = 0.03, Ts = 0.01) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.u = 0.1 + 0.03*sin(17*time) + 0.3*sin(5*time);
  annotation (experiment(StopTime = 1.1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Damper with a sharp knee whose piston moves to and fro. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.ModifiedBoucWen\">Dynamics.ModifiedBoucWen</a>.</p>
</html>"));
end ModifiedBoucWen;
