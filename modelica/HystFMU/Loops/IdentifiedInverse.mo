within HystFMU.Loops;
block IdentifiedInverse "Exact inverse of an identified sum of plays"
  extends Interfaces.Inverse;
  parameter Data.BacklashIdentified identified "The plant as identified" annotation (Dialog(group = "Parameters"), Placement(transformation(extent = {{-80, 40}, {-60, 60}})));
  parameter Types.Time Ts = 1e-4 "Sample period" annotation (Dialog(group = "Sampling"));
  Affine readout(gain = 1/identified.readout_gain[1], offset = -identified.readout_offset[1]/identified.readout_gain[1]) "From the displacement to the output of the operator" annotation (Placement(transformation(extent = {{-60, -10}, {-40, 10}})));
  Inverse.Sampled.PrandtlIshlinskiiInverse hysteresis(n = identified.hysteresis_n, depth = 16, w0 = identified.hysteresis_w0, r = identified.hysteresis_r, w = identified.hysteresis_w, u0 = identified.hysteresis_u0, Ts = Ts) annotation (Placement(transformation(extent = {{20, -10}, {40, 10}})));
equation
  connect(y, readout.u) annotation (Line(points = {{-110, 0}, {-61, 0}}, color = {0, 0, 127}));
  connect(readout.y, hysteresis.y) annotation (Line(points = {{-39, 0}, {19, 0}}, color = {0, 0, 127}));
  connect(hysteresis.u, u) annotation (Line(points = {{41, 0}, {110, 0}}, color = {0, 0, 127}));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = gain H(u) + offset, solved for u by the inverse of H in closed form.</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001.</p>
<p><b>Limitations:</b> a record of the kind of Data.BacklashIdentified: scaling behind plays.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.Pid\">Examples.Pid</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Sampled.PrandtlIshlinskiiInverse\">Inverse.Sampled.PrandtlIshlinskiiInverse</a>.</p>
</html>"));
end IdentifiedInverse;
