within HystFMU.Operators.Events;
block PrandtlIshlinskii "Prandtl-Ishlinskii operator: linear term plus weighted plays, events at reversals"
  extends BaseClasses.PrandtlIshlinskii(final usesRate = true);
  extends Interfaces.Reversals(eps = 1e-9*max(r));
protected
  // the states are the plays, because a search in the list of extrema takes twice the time
  discrete Real z_turn[n](start = fill(u0, n), each fixed = true) "Plays at the last reversal";
  Real p[n] "Plays";
equation
  connect(du, rate) annotation (Line(points = {{-110, -70}, {-80, -70}}, color = {0, 0, 127}));
  assert(Functions.isNotDecreasing(r), "the thresholds r must not decrease");
  when {initial(), change(rising)} then
    z_turn = Functions.play(u, r, pre(z_turn));
  end when;
  for i in 1:n loop
    p[i] = noEvent(max(u - r[i], min(u + r[i], z_turn[i])));
  end for;
  y = w0*u + w*p;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> all plays start from u0. The memory is complete: the parameter depth has no effect here.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.PrandtlIshlinskii\">Operators.BaseClasses.PrandtlIshlinskii</a>: equation, source, example.</p>
</html>"));
end PrandtlIshlinskii;
