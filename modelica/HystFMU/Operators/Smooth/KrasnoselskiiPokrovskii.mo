within HystFMU.Operators.Smooth;
block KrasnoselskiiPokrovskii "Krasnosel'skii-Pokrovskii operator: weighted kernels between two ramps, smooth"
  extends BaseClasses.KrasnoselskiiPokrovskii(final usesRate = true);
  extends Interfaces.Rated;
  parameter Real width(min = 0) = 1e-3 "Input on which the corner of a play is rounded, greater than 0: the bound of the error of a play";
protected
  Real k[n] "Kernels";
initial equation
  k = Functions.kernel(u, a, p1, p2, k0);
equation
  connect(du, rate);
  assert(min(p2 - p1) >= 0, "p1 must not be greater than p2: a kernel falls left of where it rises");
  for i in 1:n loop
    der(k[i]) = Functions.kernelRate(u, rate, a, p1[i], p2[i], k[i], width);
  end for;
  y = offset + w*k;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> k = max(k, ridge(u - p2)) rising, min(k, ridge(u - p1)) falling, ridge(x) = min(max(2 x/a - 1, -1), 1), y = offset + sum_i w_i k_i.</p>
<p><b>Source:</b> Krasnosel'skii &amp; Pokrovskii 1989, chapter 2; ridge function of Webb, Lagoudas &amp; Kurdila 1998.</p>
<p><b>Limitations:</b> An ordinary differential equation without events, driven by the rate of the input; p1 must not be greater than p2. A play lags behind the exact one by at most width.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.KrasnoselskiiPokrovskii\">Operators.Sampled.KrasnoselskiiPokrovskii</a>, <a href=\"modelica://HystFMU.Operators.Events.KrasnoselskiiPokrovskii\">Operators.Events.KrasnoselskiiPokrovskii</a>, <a href=\"modelica://HystFMU.Validation.Smooth.KrasnoselskiiPokrovskii\">Validation.Smooth.KrasnoselskiiPokrovskii</a>.</p>
</html>"));
end KrasnoselskiiPokrovskii;
