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
<p><b>Limitations:</b> p1 must not be greater than p2.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.KrasnoselskiiPokrovskii\">Operators.BaseClasses.KrasnoselskiiPokrovskii</a>: equation, source, example.</p>
</html>"));
end KrasnoselskiiPokrovskii;
