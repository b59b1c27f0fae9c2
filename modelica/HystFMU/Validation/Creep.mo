within HystFMU.Validation;
model Creep "Two lags with a held input"
  extends Icons.Example;
  Dynamics.Creep tested(n = 2, w = {0.3, 0.1}, T = {0.005, 0.1});
protected
  discrete Real u_k(start = 0, fixed = true) "Held input";
equation
  // held between samples, as the unit's input is
  when sample(0, 1e-3) then
    u_k = 1 + sin(60*time) + 0.3*cos(290*time);
  end when;
  tested.u = u_k;
  annotation (
    experiment(StopTime = 0.5, Interval = 0.001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Two lags with a held input; the test holds it against the unit of the same name at every sample.</p>
</html>"));
end Creep;
