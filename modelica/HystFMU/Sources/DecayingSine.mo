within HystFMU.Sources;
block DecayingSine "Decaying sine reference with derivatives and preview"
  extends Icons.Source;
  parameter Real amplitude = 1 "Factor of the signal";
  parameter Real offset = 0 "Added to the signal";
  parameter Types.Frequency frequency(min = 0, max = 1e12) = 1 "Frequency";
  parameter Types.Angle phase(min = -1e12, max = 1e12) = 0 "Phase at time 0";
  parameter Real decay(unit = "1/s", min = 0, max = 1e12) = 0.1 "Rate of decay";
  parameter Types.Time lead(min = -1e12, max = 1e12) = 0 "Preview of r_lead, dr_lead and ddr_lead";
  Interfaces.RealOutput r "Signal at the present time" annotation (Placement(transformation(extent = {{100, 65}, {120, 85}})));
  Interfaces.RealOutput r_lead "Signal lead seconds ahead" annotation (Placement(transformation(extent = {{100, 15}, {120, 35}})));
  Interfaces.RealOutput dr_lead(unit = "1/s") "Its first derivative" annotation (Placement(transformation(extent = {{100, -35}, {120, -15}})));
  Interfaces.RealOutput ddr_lead(unit = "1/s2") "Its second derivative" annotation (Placement(transformation(extent = {{100, -85}, {120, -65}})));
protected
  Real now[3] "Signal and derivatives before factor and offset";
  Real ahead[3] "Likewise, lead seconds ahead";
equation
  now = Functions.decayingSineWave(time, frequency, phase, decay);
  ahead = Functions.decayingSineWave(time + lead, frequency, phase, decay);
  r = offset + amplitude*now[1];
  r_lead = offset + amplitude*ahead[1];
  dr_lead = amplitude*ahead[2];
  ddr_lead = amplitude*ahead[3];
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> r = offset + amplitude w(t), w = e<sup>-decay t</sup> sin(2 pi frequency t + phase). r_lead, dr_lead, ddr_lead = r, r', r'' at t + lead.</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, section IV.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.DecayingSine\">Validation.DecayingSine</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.Sine\">Sources.Sine</a>, <a href=\"modelica://HystFMU.Interfaces.Reversals\">Interfaces.Reversals</a>.</p>
</html>"));
end DecayingSine;
