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
<p><b>Limitations:</b> p1 must not be greater than p2. A play lags behind the exact one by at most width.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.KrasnoselskiiPokrovskii\">Operators.BaseClasses.KrasnoselskiiPokrovskii</a>: equation, source, example.</p>
</html>"));
end KrasnoselskiiPokrovskii;
