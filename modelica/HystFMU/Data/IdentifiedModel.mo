within HystFMU.Data;
partial record IdentifiedModel "Data of an identified model"
  parameter String key = "" "Kind of model, as in the option --model of hystfmu fit" annotation (Dialog(group = "Identification"));
  parameter Types.Time Ts(min = 1e-12) = 1e-3 "Sample period of the identification" annotation (Dialog(group = "Sampling"));
  parameter Real rms_percent(min = 0) = 0 "RMS error on the training rows, in percent of the span of the output" annotation (Dialog(group = "Identification"));
  parameter Real max_percent(min = 0) = 0 "Largest error on the training rows, in percent of the span of the output" annotation (Dialog(group = "Identification"));
  annotation (
    Icon(graphics = {Rectangle(extent = {{-100, -60}, {100, 60}}, lineColor = {64, 64, 64}, fillColor = {255, 215, 136}, fillPattern = FillPattern.Solid)}),
    Documentation(info = "<html>
<p>The records that <code>hystfmu export --modelica</code> writes extend this record. They contain the values of their blocks.</p>
<p><b>Limitation:</b> the errors refer to the data of the fit; they may be larger for other signals.</p>
</html>"));
end IdentifiedModel;
