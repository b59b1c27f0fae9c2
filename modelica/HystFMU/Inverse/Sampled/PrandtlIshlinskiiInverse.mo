within HystFMU.Inverse.Sampled;
block PrandtlIshlinskiiInverse "Exact inverse of the Prandtl-Ishlinskii operator, sampled"
  extends BaseClasses.PrandtlIshlinskiiInverse(u(start = u0, fixed = true));
  extends Interfaces.Sampled;
protected
  parameter Real y0 = (w0 + sum(w))*u0 "Output of the operator at rest";
  discrete Real extrema[3 + 2*depth](start = cat(1, {0, 0, y0}, zeros(2*depth)), each fixed = true) "Dominant extrema of y";
equation
  assert(Functions.isNotDecreasing(r), "the thresholds r must not decrease");
  assert(Functions.leastSlope(w0, w) > 0, "w0 and w0 + w_1 + ... + w_i must be greater than 0 for every i, so that the loading curve increases");
  when sample(t0, Ts) then
    extrema = Functions.turn(y, y0, pre(u), pre(extrema));
    u = Functions.prandtlIshlinskiiInverse(y, Functions.branchOrigin(extrema, y0, u0, 2), w0, r, w);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> w0 and w0 + w_1 + ... + w_i must be greater than 0.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.BaseClasses.PrandtlIshlinskiiInverse\">Inverse.BaseClasses.PrandtlIshlinskiiInverse</a>: equation, source, example.</p>
</html>"));
end PrandtlIshlinskiiInverse;
