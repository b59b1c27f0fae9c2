within HystFMU.Inverse;
block PrandtlIshlinskiiInverse "Exact inverse of the Prandtl-Ishlinskii operator"
  extends Interfaces.Sampled;
  parameter Integer n(min = 1) = 10 "Number of play operators";
  parameter Integer depth(min = 4) = 256 "Extrema that the memory holds";
  parameter Real w0(min = 0) = 1 "Weight of the linear term, greater than 0";
  parameter Real r[n](each min = 0) = fill(0.1, n) "Thresholds (play half-widths), not decreasing";
  parameter Real w[n] = fill(0.1, n) "Weights of the plays";
  parameter Real u0 = 0 "Initial memory: every play rests at this value of u";
  Interfaces.RealInput y "Wanted output of the operator" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput u(start = u0, fixed = true) "Input of the operator that gives y" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  parameter Real y0 = (w0 + sum(w))*u0 "Output of the operator at rest";
  discrete Real memory[3 + 2*depth](start = cat(1, {0, 0, y0}, zeros(2*depth)), each fixed = true) "Dominant extrema of y";
equation
  assert(Functions.isNotDecreasing(r), "the thresholds r must not decrease");
  assert(Functions.leastSlope(w0, w) > 0, "w0 and w0 + w_1 + ... + w_i must be greater than 0 for every i: the loading curve must increase");
  when sample(0, Ts) then
    memory = Functions.turn(y, y0, pre(u), pre(memory));
    u = Functions.prandtlIshlinskiiInverse(y, Functions.branchOrigin(memory, y0, u0, 2), w0, r, w);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> u such that w0 u + sum_i w_i p_{r_i}[u] = y.</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 10-14.</p>
<p><b>Limitations:</b> w0 and w0 + w_1 + ... + w_i must be greater than 0; extrema between two samples are not seen; the time of a step grows with depth.</p>
</html>"));
end PrandtlIshlinskiiInverse;
