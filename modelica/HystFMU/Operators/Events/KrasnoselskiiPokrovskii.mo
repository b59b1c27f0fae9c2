within HystFMU.Operators.Events;
block KrasnoselskiiPokrovskii "Krasnosel'skii-Pokrovskii operator: weighted kernels between two ramps, events at reversals"
  extends BaseClasses.KrasnoselskiiPokrovskii(final usesRate = true);
  extends Interfaces.Reversals;
protected
  discrete Real k_turn[n](start = k0, each fixed = true) "Kernels at the last reversal";
equation
  connect(du, rate);
  assert(min(p2 - p1) >= 0, "p1 must not be greater than p2: a kernel falls left of where it rises");
  when {initial(), change(rising)} then
    k_turn = Functions.kernel(u, a, p1, p2, pre(k_turn));
  end when;
  y = offset + w*Functions.kernel(u, a, p1, p2, k_turn);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> k = max(k, ridge(u - p2)) rising, min(k, ridge(u - p1)) falling, ridge(x) = min(max(2 x/a - 1, -1), 1), y = offset + sum_i w_i k_i.</p>
<p><b>Source:</b> Krasnosel'skii &amp; Pokrovskii 1989, chapter 2; ridge function of Webb, Lagoudas &amp; Kurdila 1998.</p>
<p><b>Limitations:</b> One event for each reversal of the input, in between a closed form of the input: exact whatever the solver's step; p1 must not be greater than p2. A jump of the input must be a ramp, because the rate tells where it turns; only the sign of the rate is used.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.KrasnoselskiiPokrovskii\">Operators.Sampled.KrasnoselskiiPokrovskii</a>, <a href=\"modelica://HystFMU.Operators.Smooth.KrasnoselskiiPokrovskii\">Operators.Smooth.KrasnoselskiiPokrovskii</a>, <a href=\"modelica://HystFMU.Validation.Events.KrasnoselskiiPokrovskii\">Validation.Events.KrasnoselskiiPokrovskii</a>.</p>
</html>"));
end KrasnoselskiiPokrovskii;
