within HystFMU.Operators.Sampled;
block KrasnoselskiiPokrovskii "Krasnosel'skii-Pokrovskii operator: weighted kernels between two ramps, sampled"
  extends BaseClasses.KrasnoselskiiPokrovskii;
  extends Interfaces.Sampled;
protected
  discrete Real k[n](start = k0, each fixed = true) "Kernels";
equation
  assert(min(p2 - p1) >= 0, "p1 must not be greater than p2: a kernel falls left of where it rises");
  when sample(0, Ts) then
    k = Functions.kernel(u, a, p1, p2, pre(k));
    y = offset + w*k;
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> k = max(k, ridge(u - p2)) rising, min(k, ridge(u - p1)) falling, ridge(x) = min(max(2 x/a - 1, -1), 1), y = offset + sum_i w_i k_i.</p>
<p><b>Source:</b> Krasnosel'skii &amp; Pokrovskii 1989, chapter 2; ridge function of Webb, Lagoudas &amp; Kurdila 1998.</p>
<p><b>Limitations:</b> Acts at 0, Ts, 2 Ts, ...: the unit of the same name stepped with Ts; extrema between two samples are not seen; p1 must not be greater than p2.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Events.KrasnoselskiiPokrovskii\">Operators.Events.KrasnoselskiiPokrovskii</a>, <a href=\"modelica://HystFMU.Operators.Smooth.KrasnoselskiiPokrovskii\">Operators.Smooth.KrasnoselskiiPokrovskii</a>, <a href=\"modelica://HystFMU.Validation.Sampled.KrasnoselskiiPokrovskii\">Validation.Sampled.KrasnoselskiiPokrovskii</a>.</p>
</html>"));
end KrasnoselskiiPokrovskii;
