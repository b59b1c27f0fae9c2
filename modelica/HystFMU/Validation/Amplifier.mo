within HystFMU.Validation;
model Amplifier "Amplifier at its current limit, at a limit of voltage, and between them, with a held input"
  extends Icons.Example;
  Dynamics.Amplifier tested(u_min = -20, u_max = 80, i_max = 0.25, C = 1.8e-6, f_b = 2e3) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
protected
  discrete Types.Voltage u_k(start = 0, fixed = true) "Held input";
equation
  // held between samples, like the input of the unit
  when sample(0, 0.0001) then
    u_k = 60 + 70*sin(600*time) + 0.3*cos(2900*time);
  end when;
  tested.u = u_k;
  annotation (
    experiment(StopTime = 0.02, Interval = 0.0001, Tolerance = 1e-12),
    Documentation(info = "<html>
<p>Amplifier at its current limit, at a limit of voltage, and between them, with a held input; the test compares it with the unit of the same name.</p>
</html>"));
end Amplifier;
