// generated from tests/vectors/derived/bumpless_transfer.toml by `make generate` - do not edit
within HystFMU.Validation;
model BumplessTransfer "Bumpless transfer: the output changes from the present command to a new one without a jump, values of its first vector"
  extends Icons.Example;
  Control.BumplessTransfer tested(T = 0.5, Ts = 0.01) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.u_c = 1e300*sin(7*time);
  tested.u_present = 1e300*sin(5*time);
  annotation (experiment(StopTime = 1.1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Bumpless transfer: the output changes from the present command to a new one without a jump, values of its first vector. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.BumplessTransfer\">Control.BumplessTransfer</a>.</p>
</html>"));
end BumplessTransfer;
