within HystFMU.Loops;
block IpmcSensor "Sensor of an ionic polymer: plays, a quadratic term, a lag and two drifts"
  extends Interfaces.Plant;
  parameter Real gain = 0.2 "Scaled displacement per mm" annotation (Dialog(group = "Parameters"));
  parameter Real w0 = 0.2823656974620971 "Weight of the linear term" annotation (Dialog(group = "Parameters"));
  parameter Real r[10](each min = 0) = {0.031, 0.072, 0.118, 0.151, 0.209, 0.247, 0.301, 0.366, 0.423, 0.487} "Half-widths of the plays" annotation (Dialog(group = "Parameters"));
  parameter Real w[10] = {0.10541652705251627, 0.08188605226400816, 0.1232996878917824, 0.08847458520479042, 0.09976921310327432, 0.07341508134014525, 0.11576993595945981, 0.06494411041628233, 0.09600433713711301, 0.08565092823016945} "Weights of the plays" annotation (Dialog(group = "Parameters"));
  parameter Real bend = 0.04 "Weight of the quadratic term" annotation (Dialog(group = "Parameters"));
  parameter Types.Time T(min = 0) = 4e-3 "Lag" annotation (Dialog(group = "Parameters"));
  parameter Types.Time T_drift[2](each min = 0) = {0.3, 3} "Time constants of the drifts" annotation (Dialog(group = "Parameters"));
  parameter Real share[2] = {0.01, 0.008} "Steady-state shares of the drifts" annotation (Dialog(group = "Parameters"));
  parameter Types.Time Ts = 1e-4 "Sample period of the plays" annotation (Dialog(group = "Sampling"));
  Affine scaled(gain = gain) "Scaling to the range of the plays" annotation (Placement(transformation(extent = {{-80, -10}, {-60, 10}})));
  Operators.Sampled.BacklashSum plays(n = 10, w0 = w0, r = r, w = w, Ts = Ts) annotation (Placement(transformation(extent = {{-30, -10}, {-10, 10}})));
protected
  Real late(start = 0, fixed = true) "Output of plays and quadratic term after the lag";
  Real drift[2](each start = 0, each fixed = true) "Lags of v";
equation
  connect(u, scaled.u) annotation (Line(points = {{-110, 0}, {-81, 0}}, color = {0, 0, 127}));
  connect(scaled.y, plays.u) annotation (Line(points = {{-59, 0}, {-31, 0}}, color = {0, 0, 127}));
  T*der(late) = plays.y*(1 + bend*plays.y) - late;
  T_drift[1]*der(drift[1]) = late - drift[1];
  T_drift[2]*der(drift[2]) = late - drift[2];
  y = late - share*drift;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> T v' = s + bend s<sup>2</sup> - v, s the sum of plays of gain u; T<sub>i</sub> d<sub>i</sub>' = v - d<sub>i</sub>; y = v - share d. Displacement in mm, voltage in mV.</p>
<p><b>Source:</b> synthetic, scenarios/models/ipmc_sensor.model.toml.</p>
<p><b>Limitations:</b> the plays are sampled and their output is held over Ts.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.IpmcNetwork\">Examples.IpmcNetwork</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Loops.IpmcCompensator\">Loops.IpmcCompensator</a>, <a href=\"modelica://HystFMU.Operators.Sampled.BacklashSum\">Operators.Sampled.BacklashSum</a>.</p>
</html>"));
end IpmcSensor;
