within HystFMU.Dynamics;
block Quantiser "Uniform quantiser of an ADC or DAC"
  extends BaseClasses.Quantiser;
equation
  y = offset + q*floor((u - offset)/q + 0.5);
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> one event for each level that the input crosses.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.BaseClasses.Quantiser\">Dynamics.BaseClasses.Quantiser</a>: equation, source, example.</p>
</html>"));
end Quantiser;
