within HystFMU.Inverse.Events;
block PrandtlIshlinskiiInverse "Exact inverse of the Prandtl-Ishlinskii operator, events at reversals"
  extends BaseClasses.PrandtlIshlinskiiInverse(final usesRate = true);
  extends Interfaces.Reversals(eps = 1e-9*(w0*max(r) + w*(fill(max(r), n) - r)));
protected
  parameter Real y0 = (w0 + sum(w))*u0 "Output of the operator at rest";
  discrete Real extrema[3 + 2*depth](start = cat(1, {0, 0, y0}, zeros(2*depth)), each fixed = true) "Dominant extrema of y";
  discrete Real u_turn(start = u0, fixed = true) "Output at the last reversal";
equation
  connect(dy, rate) annotation (Line(points = {{-110, -70}, {-80, -70}}, color = {0, 0, 127}));
  assert(Functions.isNotDecreasing(r), "the thresholds r must not decrease");
  assert(Functions.leastSlope(w0, w) > 0, "w0 and w0 + w_1 + ... + w_i must be greater than 0 for every i, so that the loading curve increases");
  when {initial(), change(rising)} then
    extrema = Functions.turn(y, y0, pre(u_turn), pre(extrema));
    u_turn = Functions.prandtlIshlinskiiInverse(y, Functions.branchOrigin(extrema, y0, u0, 2), w0, r, w);
  end when;
  u = Functions.prandtlIshlinskiiInverse(y, Functions.branchOrigin(Functions.turn(y, y0, u_turn, extrema), y0, u0, 2), w0, r, w);
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> w0 and w0 + w_1 + ... + w_i must be greater than 0.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.BaseClasses.PrandtlIshlinskiiInverse\">Inverse.BaseClasses.PrandtlIshlinskiiInverse</a>: equation, source, example.</p>
</html>"));
end PrandtlIshlinskiiInverse;
