within HystFMU.Sources;
block RandomReversals "Random nested reversals with derivatives and preview"
  extends BaseClasses.RandomReversals;
protected
  parameter Real levels[m + 1] = Functions.randomLevels(seed, m) "Levels";
  Real now[3] "Signal and derivatives before factor and offset";
  Real ahead[3] "Signal and derivatives lead seconds ahead, before factor and offset";
equation
  now = Functions.reversalsWave(time, levels, frequency);
  ahead = Functions.reversalsWave(time + lead, levels, frequency);
  r = offset + amplitude*now[1];
  r_lead = offset + amplitude*ahead[1];
  dr_lead = amplitude*ahead[2];
  ddr_lead = amplitude*ahead[3];
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> r = offset + amplitude w(t), w connects levels by half cosines; each random level is alternately above or below the last level. r_lead, dr_lead, ddr_lead = r, r', r'' at t + lead.</p>
<p><b>Source:</b> SplitMix64: Steele, Lea &amp; Flood 2014; the unit <em>reference</em> with shape random_reversals, the same levels for a seed.</p>
<p><b>Limitations:</b> none.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.BaseClasses.RandomReversals\">Sources.BaseClasses.RandomReversals</a>: equation, source, example.</p>
</html>"));
end RandomReversals;
