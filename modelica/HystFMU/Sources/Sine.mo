within HystFMU.Sources;
block Sine "Sine reference with derivatives and preview for a feed-forward"
  extends BaseClasses.Sine;
protected
  constant Real turn(unit = "rad") = 6.283185307179586 "Number 2 pi";
equation
  r = offset + amplitude*sin(turn*frequency*time + phase);
  r_lead = offset + amplitude*sin(turn*frequency*(time + lead) + phase);
  dr_lead = amplitude*turn*frequency*cos(turn*frequency*(time + lead) + phase);
  ddr_lead = -amplitude*(turn*frequency)^2*sin(turn*frequency*(time + lead) + phase);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> r = offset + amplitude sin(2 pi frequency t + phase); r_lead, dr_lead, ddr_lead = r, r', r'' at t + lead.</p>
<p><b>Source:</b> definition; the unit <em>reference</em> with shape sine.</p>
<p><b>Limitations:</b> none. The other shapes of the unit <em>reference</em> have separate blocks.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.BaseClasses.Sine\">Sources.BaseClasses.Sine</a>: equation, source, example.</p>
</html>"));
end Sine;
