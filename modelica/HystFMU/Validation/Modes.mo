within HystFMU.Validation;
model Modes "Two lightly damped modes at rest with a held input"
  extends Icons.Example;
  Dynamics.Modes tested(n = 2, f_n = {500, 1600}, zeta = {0.02, 0.01}, k = {0.9, 0.1}) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
protected
  discrete Real u_k(start = 0, fixed = true) "Held input";
equation
  // held between samples, like the input of the unit
  when sample(0, 0.0001) then
    u_k = 1 + sin(600*time) + 0.3*cos(2900*time);
  end when;
  tested.u = u_k;
  annotation (
    experiment(StopTime = 0.03, Interval = 0.0001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Two lightly damped modes at rest with a held input; the test compares it with the unit of the same name.</p>
</html>"));
end Modes;
