within HystFMU.Sources;
block Sine "Sine reference with derivatives and preview for a feed-forward"
  extends Icons.Source;
  parameter Real amplitude = 1 "Factor of the signal";
  parameter Real offset = 0 "Added to the signal";
  parameter Types.Frequency frequency(min = 0, max = 1e12) = 1 "Frequency";
  parameter Types.Angle phase(min = -1e12, max = 1e12) = 0 "Phase at time 0";
  parameter Types.Time lead(min = -1e12, max = 1e12) = 0 "Preview of r_lead, dr_lead and ddr_lead";
  Interfaces.RealOutput r "Signal at the present time" annotation (Placement(transformation(extent = {{100, 65}, {120, 85}})));
  Interfaces.RealOutput r_lead "Signal lead seconds ahead" annotation (Placement(transformation(extent = {{100, 15}, {120, 35}})));
  Interfaces.RealOutput dr_lead(unit = "1/s") "Its first derivative" annotation (Placement(transformation(extent = {{100, -35}, {120, -15}})));
  Interfaces.RealOutput ddr_lead(unit = "1/s2") "Its second derivative" annotation (Placement(transformation(extent = {{100, -85}, {120, -65}})));
protected
  constant Real turn(unit = "rad") = 6.283185307179586 "One turn";
equation
  r = offset + amplitude*sin(turn*frequency*time + phase);
  r_lead = offset + amplitude*sin(turn*frequency*(time + lead) + phase);
  dr_lead = amplitude*turn*frequency*cos(turn*frequency*(time + lead) + phase);
  ddr_lead = -amplitude*(turn*frequency)^2*sin(turn*frequency*(time + lead) + phase);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> r = offset + amplitude sin(2 pi frequency t + phase); r_lead, dr_lead, ddr_lead = r, r', r'' at t + lead.</p>
<p><b>Source:</b> definition; the unit <em>reference</em> with shape sine.</p>
<p><b>Limitations:</b> none; the other shapes of the unit <em>reference</em> have blocks of their own.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.Cascade\">Examples.Cascade</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.Triangle\">Sources.Triangle</a>, <a href=\"modelica://HystFMU.Sources.Multisine\">Sources.Multisine</a>, <a href=\"modelica://HystFMU.Sources.RandomReversals\">Sources.RandomReversals</a>.</p>
</html>"));
end Sine;
