within HystFMU.Examples;
model RateDependence "Hysteresis, creep and dynamics at a low and a high frequency"
  extends Icons.Example;
  Sources.Sine slow(frequency = 5) annotation (Placement(transformation(extent = {{-90, 30}, {-70, 50}})));
  Sources.Sine fast(frequency = 100) annotation (Placement(transformation(extent = {{-90, -50}, {-70, -30}})));
  Operators.Events.PrandtlIshlinskii slowHysteresis(n = 10, depth = 16, w0 = 0.3, r = linspace(0.05, 0.5, 10), w = fill(0.1, 10)) annotation (Placement(transformation(extent = {{-50, 30}, {-30, 50}})));
  Operators.Events.PrandtlIshlinskii fastHysteresis(n = 10, depth = 16, w0 = 0.3, r = linspace(0.05, 0.5, 10), w = fill(0.1, 10)) annotation (Placement(transformation(extent = {{-50, -50}, {-30, -30}})));
  Operators.Smooth.Creep slowCreep(n = 2, w = {0.05, 0.05}, T = {0.02, 0.2}) annotation (Placement(transformation(extent = {{-10, 60}, {10, 80}})));
  Operators.Smooth.Creep fastCreep(n = 2, w = {0.05, 0.05}, T = {0.02, 0.2}) annotation (Placement(transformation(extent = {{-10, -80}, {10, -60}})));
  Dynamics.TransferFunction slowDynamics(na = 2, b = {omega_n^2}, a = {1, 1.4*omega_n, omega_n^2}) annotation (Placement(transformation(extent = {{-10, 30}, {10, 50}})));
  Dynamics.TransferFunction fastDynamics(na = 2, b = {omega_n^2}, a = {1, 1.4*omega_n, omega_n^2}) annotation (Placement(transformation(extent = {{-10, -50}, {10, -30}})));
  Dynamics.Sum slowOutput annotation (Placement(transformation(extent = {{40, 30}, {60, 50}})));
  Dynamics.Sum fastOutput annotation (Placement(transformation(extent = {{40, -50}, {60, -30}})));
  parameter Real omega_n(unit = "rad/s") = 3141.592653589793 "Natural angular frequency, 500 Hz" annotation (Dialog(group = "Parameters"));
equation
  connect(slow.r, slowHysteresis.u) annotation (Line(points = {{-69, 46}, {-60, 46}, {-60, 40}, {-51, 40}}, color = {0, 0, 127}));
  connect(slow.dr_lead, slowHysteresis.du) annotation (Line(points = {{-69, 38}, {-60, 38}, {-60, 33}, {-51, 33}}, color = {0, 0, 127}));
  connect(fast.r, fastHysteresis.u) annotation (Line(points = {{-69, -34}, {-60, -34}, {-60, -40}, {-51, -40}}, color = {0, 0, 127}));
  connect(fast.dr_lead, fastHysteresis.du) annotation (Line(points = {{-69, -42}, {-60, -42}, {-60, -47}, {-51, -47}}, color = {0, 0, 127}));
  connect(slowHysteresis.y, slowDynamics.u) annotation (Line(points = {{-29, 40}, {-11, 40}}, color = {0, 0, 127}));
  connect(fastHysteresis.y, fastDynamics.u) annotation (Line(points = {{-29, -40}, {-11, -40}}, color = {0, 0, 127}));
  connect(slowHysteresis.y, slowCreep.u) annotation (Line(points = {{-29, 40}, {-20, 40}, {-20, 70}, {-11, 70}}, color = {0, 0, 127}));
  connect(fastHysteresis.y, fastCreep.u) annotation (Line(points = {{-29, -40}, {-20, -40}, {-20, -70}, {-11, -70}}, color = {0, 0, 127}));
  connect(slowDynamics.y, slowOutput.u[1]) annotation (Line(points = {{11, 40}, {39, 40}}, color = {0, 0, 127}));
  connect(slowCreep.y, slowOutput.u[2]) annotation (Line(points = {{11, 70}, {25, 70}, {25, 40}, {39, 40}}, color = {0, 0, 127}));
  connect(fastDynamics.y, fastOutput.u[1]) annotation (Line(points = {{11, -40}, {39, -40}}, color = {0, 0, 127}));
  connect(fastCreep.y, fastOutput.u[2]) annotation (Line(points = {{11, -70}, {25, -70}, {25, -40}, {39, -40}}, color = {0, 0, 127}));
  annotation (experiment(StopTime = 0.4, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>The operators do not depend on the rate. Creep widens the loop at the low frequency, and the dynamics G0(s) widen it at the high frequency. Plot slowOutput.y over slow.r and fastOutput.y over fast.r.</p>
<p><b>Source:</b> Yu &amp; Alici 2005 (G0 after the hysteresis); creep as lags: Krejci &amp; Kuhnen 2001.</p>
<p><b>Limitations:</b> creep and dynamics are linear.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.TransferFunction\">Dynamics.TransferFunction</a>, <a href=\"modelica://HystFMU.Operators.Smooth.Creep\">Operators.Smooth.Creep</a>.</p>
</html>"));
end RateDependence;
