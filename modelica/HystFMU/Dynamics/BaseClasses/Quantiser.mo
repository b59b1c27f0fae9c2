// generated from the table of fmu_build/core/blocks/dynamics/quantiser.c by `make generate` - do not edit
within HystFMU.Dynamics.BaseClasses;
partial block Quantiser "Uniform quantiser of an ADC or DAC: parameters and ports"
  extends Icons.Block;
  parameter Real q(min = 0) = 0.01 "Distance between two levels (least significant bit); greater than 0" annotation (Dialog(group = "Dynamics"));
  parameter Real offset = 0 "One of the levels" annotation (Dialog(group = "Dynamics"));
  Interfaces.RealInput u "Signal" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y "Nearest level" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = offset + q floor((u - offset) / q + 1/2).</p>
<p><b>Source:</b> Widrow &amp; Kollar 2008, chapter 1.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Quantiser\">Validation.Quantiser</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.Quantiser\">Dynamics.Quantiser</a>.</p>
</html>"));
end Quantiser;
