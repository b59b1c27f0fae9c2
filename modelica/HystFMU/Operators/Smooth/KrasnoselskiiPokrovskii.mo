within HystFMU.Operators.Smooth;
block KrasnoselskiiPokrovskii "Krasnosel'skii-Pokrovskii operator: weighted kernels between two ramps, smooth"
  extends BaseClasses.KrasnoselskiiPokrovskii(final usesRate = true);
  extends Interfaces.Rated;
  parameter Real width(min = 0) = 1e-3 "Width of the rounded corner of a kernel, greater than 0; the error of a kernel is at most width" annotation (Dialog(group = "Realisation"));
protected
  parameter Integer m = div(n*(n + 1), 2) "Number of kernels";
  parameter Real a = (hi - lo)/n "Rise length of the ridge function";
  parameter Real p1[m] = Functions.kernelGrid(n, lo, hi, false) "Inputs at which the falling ramps reach -1";
  parameter Real p2[m] = Functions.kernelGrid(n, lo, hi, true) "Inputs at which the rising ramps leave -1";
  parameter Real k0[m] = Functions.kernelStart(n, lo, hi, u0) "Kernels before the first input";
  Real k[m] "Kernels";
initial equation
  k = Functions.kernel(u, a, p1, p2, k0);
equation
  assert(width > 0 and width < 1, "width must be between 0 and 1");
  connect(du, rate) annotation (Line(points = {{-110, -70}, {-80, -70}}, color = {0, 0, 127}));
  assert(lo < hi, "lo must be less than hi");
  for i in 1:m loop
    der(k[i]) = Functions.kernelRate(u, rate, a, p1[i], p2[i], k[i], width);
  end for;
  y = offset + w*k;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> lo must be less than hi. A kernel differs from the exact kernel by at most width.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.KrasnoselskiiPokrovskii\">Operators.BaseClasses.KrasnoselskiiPokrovskii</a>: equation, source, example.</p>
</html>"));
end KrasnoselskiiPokrovskii;
