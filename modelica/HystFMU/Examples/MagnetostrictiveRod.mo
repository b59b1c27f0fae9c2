within HystFMU.Examples;
model MagnetostrictiveRod "Current drive and magnetostrictive rod move a mass"
  extends Icons.Example;
  Sources.DecayingSine command(amplitude = 0.9, frequency = 50, decay = 20) annotation (Placement(transformation(extent = {{-90, -10}, {-70, 10}})));
  Actuators.CurrentDrive drive annotation (Placement(transformation(extent = {{-50, -10}, {-30, 10}})));
  Actuators.MagnetostrictiveRod rod(withMass = false) annotation (Placement(transformation(extent = {{10, -10}, {30, 10}})));
  Plants.Ground ground annotation (Placement(transformation(extent = {{-20, -70}, {0, -50}})));
  Plants.Fixed fixed annotation (Placement(transformation(extent = {{-60, -90}, {-40, -70}})));
  Plants.SpringMassLoad load(m = 0.2, c = 300, k = 2e6) annotation (Placement(transformation(extent = {{60, -10}, {80, 10}})));
equation
  connect(command.r, drive.u) annotation (Line(points = {{-69, 6}, {-60, 6}, {-60, 0}, {-51, 0}}, color = {0, 0, 127}));
  connect(drive.pin_p, rod.pin_p) annotation (Line(points = {{-29, 5}, {9, 5}}, color = {0, 0, 255}));
  connect(drive.pin_n, rod.pin_n) annotation (Line(points = {{-29, -5}, {9, -5}}, color = {0, 0, 255}));
  connect(drive.pin_n, ground.pin) annotation (Line(points = {{-29, -5}, {-19.5, -5}, {-19.5, -49}, {-10, -49}}, color = {0, 0, 255}));
  connect(fixed.flange, rod.flange_a) annotation (Line(points = {{-39, -80}, {-9.5, -80}, {-9.5, -11}, {20, -11}}, color = {0, 127, 0}));
  connect(rod.flange_b, load.flange) annotation (Line(points = {{31, 0}, {59, 0}}, color = {0, 127, 0}));
  annotation (experiment(StopTime = 0.05, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Position of the load over current shows a hysteresis loop. The lag of the eddy currents widens the loop at higher frequency.</p>
<p><b>Source:</b> structure of the classes below.</p>
<p><b>Limitations:</b> the values are typical of a Terfenol-D rod of 50 mm, but not those of a particular rod.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.MagnetostrictiveRod\">Actuators.MagnetostrictiveRod</a>, <a href=\"modelica://HystFMU.Actuators.CurrentDrive\">Actuators.CurrentDrive</a>, <a href=\"modelica://HystFMU.Plants.SpringMassLoad\">Plants.SpringMassLoad</a>.</p>
</html>"));
end MagnetostrictiveRod;
