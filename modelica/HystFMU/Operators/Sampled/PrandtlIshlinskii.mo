within HystFMU.Operators.Sampled;
block PrandtlIshlinskii "Prandtl-Ishlinskii operator: linear term plus weighted plays, sampled"
  extends BaseClasses.PrandtlIshlinskii(y(start = (w0 + sum(w))*u0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real memory[3 + 2*depth](start = cat(1, {0, 0, u0}, zeros(2*depth)), each fixed = true) "Dominant extrema of u";
equation
  assert(Functions.isNotDecreasing(r), "the thresholds r must not decrease");
  when sample(0, Ts) then
    memory = Functions.turn(u, u0, pre(y), pre(memory));
    y = Functions.prandtlIshlinskii(u, Functions.branchOrigin(memory, u0, (w0 + sum(w))*u0, 2), w0, r, w);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = w0 u + sum_i w_i p_{r_i}[u], p_r the play of half-width r, evaluated through the dominant extrema of u.</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 5-10; Zhao &amp; Tan 2008, section II.</p>
<p><b>Limitations:</b> Acts at 0, Ts, 2 Ts, ...: the unit of the same name stepped with Ts; extrema between two samples are not seen; all plays start from u0; the time of a step grows with depth (16 is enough for most loops).</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Events.PrandtlIshlinskii\">Operators.Events.PrandtlIshlinskii</a>, <a href=\"modelica://HystFMU.Operators.Smooth.PrandtlIshlinskii\">Operators.Smooth.PrandtlIshlinskii</a>, <a href=\"modelica://HystFMU.Validation.Sampled.PrandtlIshlinskii\">Validation.Sampled.PrandtlIshlinskii</a>.</p>
</html>"));
end PrandtlIshlinskii;
