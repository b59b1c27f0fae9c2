within HystFMU.Inverse.Sampled;
block CreepInverse "Exact inverse of creep, sampled"
  extends BaseClasses.CreepInverse(y(start = 0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real q[n](each start = 0, each fixed = true) "Lagged outputs";
equation
  assert(abs(w0) > 0, "w0 must not be 0");
  when sample(t0, Ts) then
    q = if not pre(begun) then (if start == Types.Start.steady then fill(u/(w0 + sum(w)), n) else zeros(n)) else Functions.lagOfInverse(u, w0, w, T, Ts, pre(q));
    y = (u - w*q)/w0;
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> w0 must not be 0.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.BaseClasses.CreepInverse\">Inverse.BaseClasses.CreepInverse</a>: equation, source, example.</p>
</html>"));
end CreepInverse;
