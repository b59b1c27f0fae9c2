within HystFMU.Operators.Events;
block KrasnoselskiiPokrovskii "Krasnosel'skii-Pokrovskii operator: weighted kernels between two ramps, events at reversals"
  extends BaseClasses.KrasnoselskiiPokrovskii(final usesRate = true);
  extends Interfaces.Reversals(eps = 1e-9*(hi - lo));
protected
  parameter Integer m = div(n*(n + 1), 2) "Number of kernels";
  parameter Real a = (hi - lo)/n "Rise length of the ridge function";
  parameter Real p1[m] = Functions.kernelGrid(n, lo, hi, false) "Inputs at which the falling ramps reach -1";
  parameter Real p2[m] = Functions.kernelGrid(n, lo, hi, true) "Inputs at which the rising ramps leave -1";
  parameter Real k0[m] = Functions.kernelStart(n, lo, hi, u0) "Kernels before the first input";
  discrete Real k_turn[m](start = k0, each fixed = true) "Kernels at the last reversal";
equation
  connect(du, rate) annotation (Line(points = {{-110, -70}, {-80, -70}}, color = {0, 0, 127}));
  assert(lo < hi, "lo must be less than hi");
  when {initial(), change(rising)} then
    k_turn = Functions.kernel(u, a, p1, p2, pre(k_turn));
  end when;
  y = offset + w*Functions.kernel(u, a, p1, p2, k_turn);
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> lo must be less than hi.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.KrasnoselskiiPokrovskii\">Operators.BaseClasses.KrasnoselskiiPokrovskii</a>: equation, source, example.</p>
</html>"));
end KrasnoselskiiPokrovskii;
