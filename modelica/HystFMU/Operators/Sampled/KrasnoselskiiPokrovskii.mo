within HystFMU.Operators.Sampled;
block KrasnoselskiiPokrovskii "Krasnosel'skii-Pokrovskii operator: weighted kernels between two ramps, sampled"
  extends BaseClasses.KrasnoselskiiPokrovskii(y(start = offset + w*k0, fixed = true));
  extends Interfaces.Sampled;
protected
  parameter Integer m = div(n*(n + 1), 2) "Number of kernels";
  parameter Real a = (hi - lo)/n "Rise length of the ridge function";
  parameter Real p1[m] = Functions.kernelGrid(n, lo, hi, false) "Inputs at which the falling ramps reach -1";
  parameter Real p2[m] = Functions.kernelGrid(n, lo, hi, true) "Inputs at which the rising ramps leave -1";
  parameter Real k0[m] = Functions.kernelStart(n, lo, hi, u0) "Kernels before the first input";
  discrete Real k[m](start = k0, each fixed = true) "Kernels";
equation
  assert(lo < hi, "lo must be less than hi");
  when sample(t0, Ts) then
    k = Functions.kernel(u, a, p1, p2, pre(k));
    y = offset + w*k;
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> lo must be less than hi.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.KrasnoselskiiPokrovskii\">Operators.BaseClasses.KrasnoselskiiPokrovskii</a>: equation, source, example.</p>
</html>"));
end KrasnoselskiiPokrovskii;
