within HystFMU.Operators.Events;
block PrandtlIshlinskii "Prandtl-Ishlinskii operator: linear term plus weighted plays, events at reversals"
  extends BaseClasses.PrandtlIshlinskii(final usesRate = true);
  extends Interfaces.Reversals;
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
<p><b>Equation:</b> y = w0 u + sum_i w_i p_{r_i}[u], p_r the play of half-width r, evaluated through the dominant extrema of u.</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 5-10; Zhao &amp; Tan 2008, section II.</p>
<p><b>Limitations:</b> One event for each reversal of the input, in between a closed form of the input: exact whatever the solver's step; all plays start from u0; the time of a step grows with depth (16 is enough for most loops). A jump of the input must be a ramp, because the rate tells where it turns; only the sign of the rate is used.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.PrandtlIshlinskii\">Operators.Sampled.PrandtlIshlinskii</a>, <a href=\"modelica://HystFMU.Operators.Smooth.PrandtlIshlinskii\">Operators.Smooth.PrandtlIshlinskii</a>, <a href=\"modelica://HystFMU.Validation.Events.PrandtlIshlinskii\">Validation.Events.PrandtlIshlinskii</a>.</p>
</html>"));
end PrandtlIshlinskii;
