// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model Feedforward "Feed-forward of a sine"
  extends Icons.Example;
  Control.Feedforward tested(f_n = 40, zeta = 0.3, gain = 2) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.r = sin(20*time);
  tested.dr = 20*cos(20*time);
  tested.ddr = -400*sin(20*time);
  annotation (experiment(StopTime = 1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Feed-forward of a sine. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.Feedforward\">Control.Feedforward</a>.</p>
</html>"));
end Feedforward;
