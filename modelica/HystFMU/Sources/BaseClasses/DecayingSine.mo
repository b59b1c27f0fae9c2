// generated from the table of fmu_build/core/blocks/sources/reference.c by `make generate` - do not edit
within HystFMU.Sources.BaseClasses;
partial block DecayingSine "Reference signal with derivatives and preview for a feed-forward: parameters and ports"
  extends Icons.Source;
  parameter Real amplitude = 1 "Factor of the waveform" annotation (Dialog(group = "Signal"));
  parameter Real offset = 0 "Offset of the signal" annotation (Dialog(group = "Signal"));
  parameter Types.Frequency frequency(min = 0, max = 1e12) = 1 "Frequency of sine, triangle, decaying_sine; half the rate of random_reversals" annotation (Dialog(group = "Signal"));
  parameter Types.Angle phase(min = -1e12, max = 1e12) = 0 "Phase of sine, triangle and decaying_sine at time 0" annotation (Dialog(group = "Signal"));
  parameter Real decay(unit = "1/s", min = 0, max = 1e12) = 0.1 "Decay of decaying_sine: amplitude exp(-decay t)" annotation (Dialog(group = "Signal"));
  parameter Types.Time lead(min = -1e12, max = 1e12) = 0 "Preview time of r_lead, dr_lead and ddr_lead" annotation (Dialog(group = "Signal"));
  Interfaces.RealOutput r "Signal at the current time" annotation (Placement(transformation(extent = {{100, 50}, {120, 70}})));
  Interfaces.RealOutput r_lead "Signal lead seconds ahead" annotation (Placement(transformation(extent = {{100, 10}, {120, 30}})));
  Interfaces.RealOutput dr_lead(unit = "1/s") "First derivative of r_lead" annotation (Placement(transformation(extent = {{100, -30}, {120, -10}})));
  Interfaces.RealOutput ddr_lead(unit = "1/s2") "Second derivative of r_lead" annotation (Placement(transformation(extent = {{100, -70}, {120, -50}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> r(t) = offset + amplitude w(t); r_lead, dr_lead, ddr_lead = r, r', r'' at t + lead.</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, section IV (decaying sine); random reversals: SplitMix64, Steele et al. 2014.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.AmplifiedStack\">Examples.AmplifiedStack</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.DecayingSine\">Sources.DecayingSine</a>, <a href=\"modelica://HystFMU.Examples.Bender\">Examples.Bender</a>, <a href=\"modelica://HystFMU.Examples.ChargeDrive\">Examples.ChargeDrive</a>, <a href=\"modelica://HystFMU.Examples.IpmcNetwork\">Examples.IpmcNetwork</a>, <a href=\"modelica://HystFMU.Examples.MagnetostrictiveRod\">Examples.MagnetostrictiveRod</a>, <a href=\"modelica://HystFMU.Examples.StackMovesMass\">Examples.StackMovesMass</a>, <a href=\"modelica://HystFMU.Validation.DecayingSine\">Validation.DecayingSine</a>.</p>
</html>"));
end DecayingSine;
