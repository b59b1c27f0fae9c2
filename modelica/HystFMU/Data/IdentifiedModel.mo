within HystFMU.Data;
partial record IdentifiedModel "What every identified model says about itself"
  parameter String key = "" "Kind of model, as of hystfmu fit --model" annotation (Dialog(group = "Identification"));
  parameter Types.Time Ts(min = 1e-12) = 1e-3 "Sample period of the identification" annotation (Dialog(group = "Sampling"));
  parameter Real rms_percent(min = 0) = 0 "RMS error on the training rows, in percent of the span of the output" annotation (Dialog(group = "Identification"));
  parameter Real max_percent(min = 0) = 0 "Largest error there, in percent of the span of the output" annotation (Dialog(group = "Identification"));
  annotation (
    Icon(graphics = {Rectangle(extent = {{-100, -60}, {100, 60}}, lineColor = {64, 64, 64}, fillColor = {255, 215, 136}, fillPattern = FillPattern.Solid)}),
    Documentation(info = "<html>
<p>Records written by <code>hystfmu export --modelica</code> extend this one by the values of their blocks.</p>
<p><b>Limitation:</b> the errors are those on the data of the fit; other signals may give larger ones.</p>
</html>"));
end IdentifiedModel;
