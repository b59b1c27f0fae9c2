within HystFMU.Validation;
model TransferFunction "Second-order dynamics, 500 Hz, damping 0.7, with a held input, from rest"
  extends Icons.Example;
  Dynamics.TransferFunction tested(na = 2, nb = 0, b = {9.869604401089358e6}, a = {1, 4398.22971502571, 9.869604401089358e6}) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
protected
  discrete Real u_k(start = 0, fixed = true) "Held input";
equation
  // held between samples, like the input of the unit
  when sample(0, 1e-4) then
    u_k = 1 + sin(600*time) + 0.3*cos(2900*time);
  end when;
  tested.u = u_k;
  annotation (
    experiment(StopTime = 0.05, Interval = 0.0001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Second-order dynamics, 500 Hz, damping 0.7, with a held input, from rest; the test compares it with the unit of the same name with hold = zoh.</p>
</html>"));
end TransferFunction;
