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
<p><b>Limitations:</b> p1 must not be greater than p2.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.KrasnoselskiiPokrovskii\">Operators.BaseClasses.KrasnoselskiiPokrovskii</a>: equation, source, example.</p>
</html>"));
end KrasnoselskiiPokrovskii;
