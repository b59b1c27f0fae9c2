within HystFMU.Examples;
model IpmcNetwork "The basis-function network computes the displacement from the voltage of an IPMC sensor"
  extends Icons.Example;
  Sources.DecayingSine reference(amplitude = 5, frequency = 3, decay = 0.3) "Displacement in mm" annotation (Placement(transformation(extent = {{-80, -10}, {-60, 10}})));
  replaceable Loops.IpmcSensor sensor constrainedby Interfaces.Plant "Sensor to compensate" annotation (choicesAllMatching = true, Placement(transformation(extent = {{-20, -10}, {0, 10}})));
  replaceable Loops.IpmcCompensator compensator constrainedby Interfaces.Inverse "Displacement from the voltage" annotation (choicesAllMatching = true, Placement(transformation(extent = {{40, -10}, {60, 10}})));
equation
  connect(reference.r, sensor.u) annotation (Line(points = {{-59, 6}, {-40, 6}, {-40, 0}, {-21, 0}}, color = {0, 0, 127}));
  connect(sensor.y, compensator.y) annotation (Line(points = {{1, 0}, {39, 0}}, color = {0, 0, 127}));
  annotation (experiment(StopTime = 1, Interval = 0.001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Hysteresis, lag and drift of the sensor cause an error of 7.3 % of the stroke with a constant gain, and 0.6 % with the network.</p>
<p><b>Source:</b> the case sine_3 of the scenario papers/ipmc_bfbnn_compensator.</p>
<p><b>Limitations:</b> no feedback.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Loops.IpmcSensor\">Loops.IpmcSensor</a>, <a href=\"modelica://HystFMU.Loops.IpmcCompensator\">Loops.IpmcCompensator</a>.</p>
</html>"));
end IpmcNetwork;
