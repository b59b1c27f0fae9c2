// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model Lugre "LuGre friction of a surface that moves to and fro"
  extends Icons.Example;
  Dynamics.Lugre tested(sigma_0 = 40, sigma_1 = 0.25, sigma_2 = 0.125, d_c = 0.06, d_s = 0.1, v_s = 0.5, z0 = 0.03, Ts = 0.01) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.u = 0.1 + 0.03*sin(17*time) + 0.2*sin(3*time);
  annotation (experiment(StopTime = 1.1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>LuGre friction of a surface that moves to and fro. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.Lugre\">Dynamics.Lugre</a>.</p>
</html>"));
end Lugre;
