within HystFMU.Operators.Sampled;
block Duhem "Duhem operator with slopes for rising and falling input, sampled"
  extends BaseClasses.Duhem(y(start = 0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real u_last(start = u0, fixed = true) "Input at the last sample";
  discrete Real w_last(start = w0, fixed = true) "w at the last sample";
equation
  assert(abs(w0) <= w_max, "abs(w0) must be at most w_max");
  when sample(t0, Ts) then
    w_last = if u >= pre(u_last) then Functions.duhem(u, pre(u_last), pre(w_last), a_rise, b_rise, c_rise, q, w_max, du_max) else Functions.duhem(u, pre(u_last), pre(w_last), a_fall, b_fall, c_fall, q, w_max, du_max);
    u_last = u;
    y = k*u + w_last;
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> no return-point memory. There is no closed form between reversals and therefore no realisation Events.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.Duhem\">Operators.BaseClasses.Duhem</a>: equation, source, example.</p>
</html>"));
end Duhem;
