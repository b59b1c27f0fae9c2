within HystFMU.Examples;
model MinorLoops "The three realisations of one operator with nested loops"
  extends Icons.Example;
  Sources.Multisine signal(m = 2, f = {3, 17}, a = {0.7, 0.4}, ph = {0, 0}) annotation (Placement(transformation(extent = {{-80, -10}, {-60, 10}})));
  Operators.Sampled.PrandtlIshlinskii sampled(n = 10, depth = 16, w0 = 0.3, r = linspace(0.05, 0.5, 10), w = fill(0.1, 10), Ts = 1e-3) annotation (Placement(transformation(extent = {{-10, 40}, {10, 60}})));
  Operators.Events.PrandtlIshlinskii events(n = 10, depth = 16, w0 = 0.3, r = linspace(0.05, 0.5, 10), w = fill(0.1, 10)) annotation (Placement(transformation(extent = {{-10, -10}, {10, 10}})));
  replaceable Operators.Smooth.PrandtlIshlinskii hysteresis(n = 10, depth = 16, w0 = 0.3, r = linspace(0.05, 0.5, 10), w = fill(0.1, 10))
    constrainedby Operators.BaseClasses.PrandtlIshlinskii(n = 10, depth = 16, w0 = 0.3, r = linspace(0.05, 0.5, 10), w = fill(0.1, 10))
    "Realisation Smooth; replaceable" annotation (choicesAllMatching = true, Placement(transformation(extent = {{-10, -60}, {10, -40}})));
equation
  connect(signal.r, sampled.u) annotation (Line(points = {{-59, 6}, {-35, 6}, {-35, 50}, {-11, 50}}, color = {0, 0, 127}));
  connect(signal.r, events.u) annotation (Line(points = {{-59, 6}, {-35, 6}, {-35, 0}, {-11, 0}}, color = {0, 0, 127}));
  connect(signal.dr_lead, events.du) annotation (Line(points = {{-59, -2}, {-35, -2}, {-35, -7}, {-11, -7}}, color = {0, 0, 127}));
  connect(signal.r, hysteresis.u) annotation (Line(points = {{-59, 6}, {-35, 6}, {-35, -50}, {-11, -50}}, color = {0, 0, 127}));
  connect(signal.dr_lead, hysteresis.du) annotation (Line(points = {{-59, -2}, {-35, -2}, {-35, -57}, {-11, -57}}, color = {0, 0, 127}));
  annotation (experiment(StopTime = 1.0, Interval = 0.001, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Two tones cause nested minor loops. Plot the outputs over signal.r: the loops close. The three outputs differ only because of the sample period and of width. With lead = 0, dr_lead is the rate of r.</p>
<p><b>Source:</b> operator: Krejci &amp; Kuhnen 2001.</p>
<p><b>Limitations:</b> the sampled operator holds its output over Ts.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled\">Operators.Sampled</a>, <a href=\"modelica://HystFMU.Operators.Events\">Operators.Events</a>, <a href=\"modelica://HystFMU.Operators.Smooth\">Operators.Smooth</a>.</p>
</html>"));
end MinorLoops;
