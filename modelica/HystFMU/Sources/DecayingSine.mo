within HystFMU.Sources;
block DecayingSine "Decaying sine reference with derivatives and preview"
  extends BaseClasses.DecayingSine;
protected
  Real now[3] "Signal and derivatives before factor and offset";
  Real ahead[3] "Signal and derivatives lead seconds ahead, before factor and offset";
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
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.BaseClasses.DecayingSine\">Sources.BaseClasses.DecayingSine</a>: equation, source, example.</p>
</html>"));
end DecayingSine;
