within HystFMU.Operators.Events;
block PrandtlIshlinskii "Prandtl-Ishlinskii operator: linear term plus weighted plays, events at reversals"
  extends BaseClasses.PrandtlIshlinskii(final usesRate = true);
  extends Interfaces.Reversals(eps = 1e-9*max(r));
protected
  discrete Real memory[3 + 2*depth](start = cat(1, {0, 0, u0}, zeros(2*depth)), each fixed = true) "Dominant extrema of u";
  discrete Real y_turn(start = (w0 + sum(w))*u0, fixed = true) "Output at the last reversal";
equation
  connect(du, rate);
  assert(Functions.isNotDecreasing(r), "the thresholds r must not decrease");
  when {initial(), change(rising)} then
    memory = Functions.turn(u, u0, pre(y_turn), pre(memory));
    y_turn = Functions.prandtlIshlinskii(u, Functions.branchOrigin(memory, u0, (w0 + sum(w))*u0, 2), w0, r, w);
  end when;
  y = Functions.prandtlIshlinskii(u, Functions.branchOrigin(Functions.turn(u, u0, y_turn, memory), u0, (w0 + sum(w))*u0, 2), w0, r, w);
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> all plays start from u0; the time of a step grows with depth (16 is enough for most loops).</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.PrandtlIshlinskii\">Operators.BaseClasses.PrandtlIshlinskii</a>: equation, source, example.</p>
</html>"));
end PrandtlIshlinskii;
