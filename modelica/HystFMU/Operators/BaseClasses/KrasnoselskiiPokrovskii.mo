// generated from the table of fmu_build/core/blocks/operators/krasnoselskii_pokrovskii.c by `make generate` - do not edit
within HystFMU.Operators.BaseClasses;
partial block KrasnoselskiiPokrovskii "Krasnosel'skii-Pokrovskii operator: weighted kernels between two ramps: parameters and ports"
  extends Icons.Hysteresis;
  parameter Integer n(min = 1) = 4 "Number of grid points; there are n(n + 1)/2 kernels" annotation (Dialog(group = "Sizes"));
  parameter Integer depth(min = 4) = 16 "Maximum number of stored extrema" annotation (Dialog(group = "Memory"));
  parameter Real lo = -1 "Input at which the lowest ramp leaves -1" annotation (Dialog(group = "Limits"));
  parameter Real hi = 1 "Input at which the highest ramp reaches 1" annotation (Dialog(group = "Limits"));
  parameter Real w[div(n*(n + 1), 2)] = fill(0.1, div(n*(n + 1), 2)) "Weights of the kernels (p2, p1) = (0, 0), (1, 0), (1, 1), (2, 0), .., (n - 1, n - 1) in steps from lo" annotation (Dialog(group = "Weights"));
  parameter Real offset = 0 "Constant term of the output" annotation (Dialog(group = "Offset"));
  parameter Real u0 = 0 "Initial kernels: the mean of their two ramps at u0" annotation (Dialog(group = "Start"));
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput du(unit = "1/s") if usesRate "Rate of u; Sampled has no such input" annotation (Placement(transformation(extent = {{-120, -80}, {-100, -60}})));
  Interfaces.RealOutput y "Output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  constant Boolean usesRate = false "True if there is an input for the rate";
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> k = max(k, r(u - p2)) rising, min(k, r(u - p1)) falling, y = offset + sum_i w_i k_i.</p>
<p><b>Source:</b> Krasnosel'skii &amp; Pokrovskii 1989, ch. 2; ridge function of Webb, Lagoudas &amp; Kurdila 1998.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Sampled.KrasnoselskiiPokrovskii\">Validation.Sampled.KrasnoselskiiPokrovskii</a>.</p>
<p><b>Any realisation:</b> <code>replaceable Operators.Sampled.KrasnoselskiiPokrovskii hysteresis constrainedby Operators.BaseClasses.KrasnoselskiiPokrovskii;</code></p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.KrasnoselskiiPokrovskii\">Operators.Sampled.KrasnoselskiiPokrovskii</a>, <a href=\"modelica://HystFMU.Operators.Events.KrasnoselskiiPokrovskii\">Operators.Events.KrasnoselskiiPokrovskii</a>, <a href=\"modelica://HystFMU.Operators.Smooth.KrasnoselskiiPokrovskii\">Operators.Smooth.KrasnoselskiiPokrovskii</a>.</p>
</html>"));
end KrasnoselskiiPokrovskii;
