// generated from the table of fmu_build/core/blocks/operators/krasnoselskii_pokrovskii.c by `make generate` - do not edit
within HystFMU.Operators.BaseClasses;
partial block KrasnoselskiiPokrovskii "Krasnosel'skii-Pokrovskii operator: weighted kernels between two ramps: parameters and ports"
  extends Icons.Hysteresis;
  parameter Integer n(min = 1) = 10 "Number of kernels" annotation (Dialog(group = "Sizes"));
  parameter Real a(min = 1e-300) = 4 "Rise length of the ridge function";
  parameter Real p1[n] = fill(-2.25, n) "Inputs at which the falling ramps reach -1";
  parameter Real p2[n] = fill(-1.75, n) "Inputs at which the rising ramps leave -1; p1 <= p2";
  parameter Real w[n] = fill(0.1, n) "Weights of the kernels";
  parameter Real offset = 0 "Output for cancelling kernels";
  parameter Real k0[n](each min = -1, each max = 1) = fill(0.0, n) "Values of the kernels before the first input" annotation (Dialog(group = "Start"));
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput du(unit = "1/s") if usesRate "Rate of u; Sampled has no such input" annotation (Placement(transformation(extent = {{-120, -80}, {-100, -60}})));
  Interfaces.RealOutput y "Output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  constant Boolean usesRate = false "Is there an input for the rate?";
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> k = max(k, r(u - p2)) rising, min(k, r(u - p1)) falling, y = offset + sum_i w_i k_i.</p>
<p><b>Source:</b> Krasnosel'skii &amp; Pokrovskii 1989, ch. 2; ridge function of Webb, Lagoudas &amp; Kurdila 1998.</p>
<p><b>Limitations:</b> those of the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Sampled.KrasnoselskiiPokrovskii\">Validation.Sampled.KrasnoselskiiPokrovskii</a>.</p>
<p><b>Any realisation:</b> <code>replaceable Operators.Sampled.KrasnoselskiiPokrovskii hysteresis constrainedby Operators.BaseClasses.KrasnoselskiiPokrovskii;</code></p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.KrasnoselskiiPokrovskii\">Operators.Sampled.KrasnoselskiiPokrovskii</a>, <a href=\"modelica://HystFMU.Operators.Events.KrasnoselskiiPokrovskii\">Operators.Events.KrasnoselskiiPokrovskii</a>, <a href=\"modelica://HystFMU.Operators.Smooth.KrasnoselskiiPokrovskii\">Operators.Smooth.KrasnoselskiiPokrovskii</a>.</p>
</html>"));
end KrasnoselskiiPokrovskii;
