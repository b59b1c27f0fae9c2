within HystFMU.Operators.Sampled;
block PrandtlIshlinskii "Prandtl-Ishlinskii operator: linear term plus weighted plays, sampled"
  extends BaseClasses.PrandtlIshlinskii(y(start = (w0 + sum(w))*u0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real memory[3 + 2*depth](start = cat(1, {0, 0, u0}, zeros(2*depth)), each fixed = true) "Dominant extrema of u";
equation
  assert(Functions.isNotDecreasing(r), "the thresholds r must not decrease");
  when sample(t0, Ts) then
    memory = Functions.turn(u, u0, pre(y), pre(memory));
    y = Functions.prandtlIshlinskii(u, Functions.branchOrigin(memory, u0, (w0 + sum(w))*u0, 2), w0, r, w);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> all plays start from u0. The computing time of a step is proportional to depth; 16 is enough for most loops.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.PrandtlIshlinskii\">Operators.BaseClasses.PrandtlIshlinskii</a>: equation, source, example.</p>
</html>"));
end PrandtlIshlinskii;
