// generated from the table of fmu_build/core/blocks/dynamics/delay.c by `make generate` - do not edit
within HystFMU.Dynamics.BaseClasses;
partial block Delay "Delay by a whole number of steps: parameters and ports"
  extends Icons.Block;
  parameter Integer n(min = 1) = 1 "Steps of delay" annotation (Dialog(group = "Sizes"));
  parameter Real y0 = 0 "Output until the first input arrives" annotation (Dialog(group = "Start"));
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y "Input n steps ago" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y_k = u_(k-n).</p>
<p><b>Source:</b> definition of the shift operator.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.StackInLoop\">Examples.StackInLoop</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.Delay\">Dynamics.Delay</a>, <a href=\"modelica://HystFMU.Validation.Delay\">Validation.Delay</a>.</p>
</html>"));
end Delay;
