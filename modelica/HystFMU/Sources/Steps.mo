within HystFMU.Sources;
block Steps "Sequence of levels"
  extends BaseClasses.Steps;
protected
  Real now[3] "Signal and derivatives before factor and offset";
  Real ahead[3] "Signal and derivatives lead seconds ahead, before factor and offset";
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
<p><b>Limitations:</b> the derivative does not show jumps: for the realisations Events and Smooth, use ramps instead.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.BaseClasses.Steps\">Sources.BaseClasses.Steps</a>: equation, source, example.</p>
</html>"));
end Steps;
