within HystFMU.Loops;
block IdentifiedInverse "Exact inverse of an identified sum of plays"
  extends Interfaces.Inverse;
  parameter Integer n(min = 1) = identified.hysteresis_n "Number of plays" annotation (Dialog(group = "Sizes"));
  parameter Real w0 = identified.hysteresis_w0 "Weight of the linear term" annotation (Dialog(group = "Parameters"));
  parameter Real r[n](each min = 0) = identified.hysteresis_r "Half-widths of the plays" annotation (Dialog(group = "Parameters"));
  parameter Real w[n] = identified.hysteresis_w "Weights of the plays" annotation (Dialog(group = "Parameters"));
  parameter Real u0 = identified.hysteresis_u0 "Input at which the memory rests at the start" annotation (Dialog(group = "Start"));
  parameter Real gain = identified.readout_gain[1] "Factor from the output of the plays to the output of the model" annotation (Dialog(group = "Scaling"));
  parameter Real offset = identified.readout_offset[1] "Output of the model at output 0 of the plays" annotation (Dialog(group = "Scaling"));
  parameter Types.Time Ts = 1e-4 "Sample period" annotation (Dialog(group = "Sampling"));
  Affine readout(gain = 1/gain, offset = -offset/gain) "Scaling from the displacement to the output of the plays" annotation (Placement(transformation(extent = {{-60, -10}, {-40, 10}})));
  Inverse.Sampled.PrandtlIshlinskiiInverse hysteresis(n = n, depth = 16, w0 = w0, r = r, w = w, u0 = u0, Ts = Ts) annotation (Placement(transformation(extent = {{20, -10}, {40, 10}})));
protected
  parameter Data.BacklashIdentified identified "Record with the default values" annotation (Placement(transformation(extent = {{-80, 40}, {-60, 60}})));
equation
  connect(y, readout.u) annotation (Line(points = {{-110, 0}, {-61, 0}}, color = {0, 0, 127}));
  connect(readout.y, hysteresis.y) annotation (Line(points = {{-39, 0}, {19, 0}}, color = {0, 0, 127}));
  connect(hysteresis.u, u) annotation (Line(points = {{41, 0}, {110, 0}}, color = {0, 0, 127}));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = gain H(u) + offset, solved for u with the closed-form inverse of H.</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001.</p>
<p><b>Limitations:</b> the model must be a sum of plays with a scaling; the defaults are from Data.BacklashIdentified.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.Pid\">Examples.Pid</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Sampled.PrandtlIshlinskiiInverse\">Inverse.Sampled.PrandtlIshlinskiiInverse</a>.</p>
</html>"));
end IdentifiedInverse;
