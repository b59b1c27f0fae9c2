// generated from the table of fmu_build/core/blocks/sources/disturbance.c by `make generate` - do not edit
within HystFMU.Sources.BaseClasses;
partial block Disturbance "Disturbance: step plus sine: parameters and ports"
  extends Icons.Source;
  parameter Real step = 0 "Height of the step" annotation (Dialog(group = "Signal"));
  parameter Types.Time t_step = 0 "Time of the step" annotation (Dialog(group = "Signal"));
  parameter Real amplitude = 1 "Amplitude of the sine" annotation (Dialog(group = "Signal"));
  parameter Types.Frequency frequency(min = 0, max = 1e12) = 1 "Frequency of the sine" annotation (Dialog(group = "Signal"));
  parameter Types.Angle phase(min = -1e12, max = 1e12) = 0 "Phase of the sine at time 0" annotation (Dialog(group = "Signal"));
  Interfaces.RealOutput d "Disturbance" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> d = step [t &gt;= t_step] + amplitude sin(2 pi frequency t + phase).</p>
<p><b>Source:</b> definition.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Disturbance\">Validation.Disturbance</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.Disturbance\">Sources.Disturbance</a>.</p>
</html>"));
end Disturbance;
