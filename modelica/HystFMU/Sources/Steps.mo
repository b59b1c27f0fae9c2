within HystFMU.Sources;
block Steps "Levels one after the other"
  extends Icons.Source;
  parameter Integer m(min = 1) = 10 "Number of levels";
  parameter Real amplitude = 1 "Factor of the signal";
  parameter Real offset = 0 "Added to the signal";
  parameter Types.Time lead(min = -1e12, max = 1e12) = 0 "Preview of r_lead, dr_lead and ddr_lead";
  parameter Real levels[m] = fill(1.0, m) "Levels; the last one stays";
  parameter Types.Time T(min = 0, max = 1e300) = 1 "Time on a level";
  Interfaces.RealOutput r "Signal at the present time" annotation (Placement(transformation(extent = {{100, 65}, {120, 85}})));
  Interfaces.RealOutput r_lead "Signal lead seconds ahead" annotation (Placement(transformation(extent = {{100, 15}, {120, 35}})));
  Interfaces.RealOutput dr_lead(unit = "1/s") "Its first derivative" annotation (Placement(transformation(extent = {{100, -35}, {120, -15}})));
  Interfaces.RealOutput ddr_lead(unit = "1/s2") "Its second derivative" annotation (Placement(transformation(extent = {{100, -85}, {120, -65}})));
protected
  Real now[3] "Signal and derivatives before factor and offset";
  Real ahead[3] "Likewise, lead seconds ahead";
equation
  now = Functions.stepsWave(time, levels, T);
  ahead = Functions.stepsWave(time + lead, levels, T);
  r = offset + amplitude*now[1];
  r_lead = offset + amplitude*ahead[1];
  dr_lead = amplitude*ahead[2];
  ddr_lead = amplitude*ahead[3];
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> r = offset + amplitude w(t), w = level i for (i - 1) T &le; t &lt; i T. r_lead, dr_lead, ddr_lead = r, r', r'' at t + lead.</p>
<p><b>Source:</b> definition; the unit <em>reference</em> with shape steps.</p>
<p><b>Limitations:</b> the rate of a jump does not show: for the realisations Events and Smooth take a ramp instead.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Steps\">Validation.Steps</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.Sine\">Sources.Sine</a>, <a href=\"modelica://HystFMU.Interfaces.Reversals\">Interfaces.Reversals</a>.</p>
</html>"));
end Steps;
