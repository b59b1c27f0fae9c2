within HystFMU.Examples;
model PiezoStack "Identified piezo stack that moves a mass: from an electrical pin to a translational flange"
  extends Icons.Example;
  parameter Data.BacklashIdentified identified "Hysteresis as identified" annotation (Dialog(group = "Parameters"), Placement(transformation(extent = {{-90, 50}, {-70, 70}})));
  Sources.DecayingSine command(amplitude = 0.8, frequency = 40, decay = 15) annotation (Placement(transformation(extent = {{-90, -10}, {-70, 10}})));
  Plants.VoltageDrive drive annotation (Placement(transformation(extent = {{-50, -10}, {-30, 10}})));
  Plants.PiezoStack stack(n = identified.hysteresis_n, w0 = identified.hysteresis_w0, r = identified.hysteresis_r, w = identified.hysteresis_w) annotation (Placement(transformation(extent = {{0, -10}, {20, 10}})));
  Plants.Ground ground annotation (Placement(transformation(extent = {{-50, -50}, {-30, -30}})));
  Plants.Fixed fixed annotation (Placement(transformation(extent = {{-20, -40}, {0, -20}})));
  Plants.SpringMassLoad load annotation (Placement(transformation(extent = {{50, -10}, {70, 10}})));
equation
  connect(command.r, drive.u) annotation (Line(points = {{-69, 6}, {-60, 6}, {-60, 0}, {-51, 0}}, color = {0, 0, 127}));
  connect(drive.pin_p, stack.pin_p) annotation (Line(points = {{-29, 5}, {-1, 5}}, color = {0, 0, 255}));
  connect(drive.pin_n, stack.pin_n) annotation (Line(points = {{-29, -5}, {-1, -5}}, color = {0, 0, 255}));
  connect(drive.pin_n, ground.pin) annotation (Line(points = {{-29, -5}, {-23, -5}, {-23, -49}, {-46, -49}, {-46, -29}, {-40, -29}}, color = {0, 0, 255}));
  connect(fixed.flange, stack.flange_a) annotation (Line(points = {{1, -30}, {5.5, -30}, {5.5, -11}, {10, -11}}, color = {0, 127, 0}));
  connect(stack.flange_b, load.flange) annotation (Line(points = {{21, 0}, {49, 0}}, color = {0, 127, 0}));
  annotation (experiment(StopTime = 0.2, Interval = 2e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>A voltage amplifier drives a stack through its output resistance; the stack moves a mass on a spring. The rate that the hysteresis needs is that of a state: no input is differentiated. Redeclare <code>stack.hysteresis</code> to change its realisation.</p>
<p><b>Source:</b> hysteresis from scenarios/models/backlash_identified.model.toml</p>
<p><b>Limitations:</b> those of the stack.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Plants.PiezoStack\">Plants.PiezoStack</a>.</p>
</html>"));
end PiezoStack;
