within HystFMU.Sources;
block Triangle "Triangle reference with derivatives and preview"
  extends BaseClasses.Triangle;
protected
  Real now[3] "Signal and derivatives before factor and offset";
  Real ahead[3] "Signal and derivatives lead seconds ahead, before factor and offset";
equation
  now = Functions.triangleWave(time, frequency, phase, turn);
  ahead = Functions.triangleWave(time + lead, frequency, phase, turn);
  r = offset + amplitude*now[1];
  r_lead = offset + amplitude*ahead[1];
  dr_lead = amplitude*ahead[2];
  ddr_lead = amplitude*ahead[3];
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> r = offset + amplitude w(t), w a triangle with rounded turn-arounds. r_lead, dr_lead, ddr_lead = r, r', r'' at t + lead.</p>
<p><b>Source:</b> definition; the unit <em>reference</em> with shape triangle.</p>
<p><b>Limitations:</b> at corners, the derivatives are those of the next piece.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.BaseClasses.Triangle\">Sources.BaseClasses.Triangle</a>: equation, source, example.</p>
</html>"));
end Triangle;
