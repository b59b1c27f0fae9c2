within HystFMU.Operators;
block PrandtlIshlinskii "Prandtl-Ishlinskii operator: linear term plus weighted plays"
  extends Interfaces.Sampled;
  parameter Integer n(min = 1) = 10 "Number of play operators";
  parameter Integer depth(min = 4) = 256 "Extrema that the memory holds";
  parameter Real w0 = 0 "Weight of the linear term";
  parameter Real r[n](each min = 0) = fill(0.1, n) "Thresholds (play half-widths), not decreasing";
  parameter Real w[n] = fill(0.1, n) "Weights of the plays";
  parameter Real u0 = 0 "Initial memory: every play rests at this value";
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y(start = (w0 + sum(w))*u0, fixed = true) "Output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
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
<p><b>Limitations:</b> all plays start from u0; extrema between two samples are not seen; the time of a step grows with depth (16 is enough for most loops).</p>
</html>"));
end PrandtlIshlinskii;
