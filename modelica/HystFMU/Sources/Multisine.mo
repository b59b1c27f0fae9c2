within HystFMU.Sources;
block Multisine "Sum of sines with derivatives and preview"
  extends BaseClasses.Multisine;
protected
  Real now[3] "Signal and derivatives before factor and offset";
  Real ahead[3] "Signal and derivatives lead seconds ahead, before factor and offset";
equation
  now = Functions.multisineWave(time, f, a, ph);
  ahead = Functions.multisineWave(time + lead, f, a, ph);
  r = offset + amplitude*now[1];
  r_lead = offset + amplitude*ahead[1];
  dr_lead = amplitude*ahead[2];
  ddr_lead = amplitude*ahead[3];
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> r = offset + amplitude w(t), w = sum_i a_i sin(2 pi f_i t + ph_i). r_lead, dr_lead, ddr_lead = r, r', r'' at t + lead.</p>
<p><b>Source:</b> definition; the unit <em>reference</em> with shape multisine.</p>
<p><b>Limitations:</b> none.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.BaseClasses.Multisine\">Sources.BaseClasses.Multisine</a>: equation, source, example.</p>
</html>"));
end Multisine;
