// generated from the table of fmu_build/core/blocks/dynamics/transfer_function.c by `make generate` - do not edit
within HystFMU.Dynamics.BaseClasses;
partial block TransferFunction "Linear transfer function of any order, discretised exactly: parameters and ports"
  extends Icons.Block;
  parameter Integer na(min = 1) = 1 "Degree of the denominator (order)" annotation (Dialog(group = "Sizes"));
  parameter Integer nb(min = 0) = 0 "Degree of the numerator, at most na" annotation (Dialog(group = "Sizes"));
  parameter Real b[nb + 1] = fill(1.0, nb + 1) "Numerator, highest power of s first" annotation (Dialog(group = "Dynamics"));
  parameter Real a[na + 1] = fill(1.0, na + 1) "Denominator, highest power of s first; a[1] not 0" annotation (Dialog(group = "Dynamics"));
  parameter Types.Start start = Types.Start.rest "Initial states: zero, or in equilibrium with the first input" annotation (Dialog(group = "Start"));
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y "Output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = (b_0 s<sup>nb</sup> + ... + b_nb) / (a_0 s<sup>na</sup> + ... + a_na) u.</p>
<p><b>Source:</b> Van Loan 1978; Franklin, Powell &amp; Workman, 3rd ed., section 6.3.2.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.RateDependence\">Examples.RateDependence</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.TransferFunction\">Dynamics.TransferFunction</a>, <a href=\"modelica://HystFMU.Validation.TransferFunction\">Validation.TransferFunction</a>.</p>
</html>"));
end TransferFunction;
