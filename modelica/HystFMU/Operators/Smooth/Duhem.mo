within HystFMU.Operators.Smooth;
block Duhem "Duhem operator with slopes for rising and falling input, smooth"
  extends BaseClasses.Duhem(final usesRate = true);
  extends Interfaces.Rated;
protected
  Real w "State";
initial equation
  w = if u >= u0 then Functions.duhem(u, u0, w0, a_rise, b_rise, c_rise, q, w_max, du_max) else Functions.duhem(u, u0, w0, a_fall, b_fall, c_fall, q, w_max, du_max);
equation
  connect(du, rate) annotation (Line(points = {{-110, -70}, {-80, -70}}, color = {0, 0, 127}));
  assert(abs(w0) <= w_max, "abs(w0) must be at most w_max");
  der(w) = noEvent(if rate > 0 then Functions.duhemSlope(u, w, a_rise, b_rise, c_rise, q)*rate else Functions.duhemSlope(u, w, a_fall, b_fall, c_fall, q)*rate);
  y = k*u + min(max(w, -w_max), w_max);
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> no return-point memory. There is no closed form between reversals and therefore no realisation Events. The parameter du_max is used only from u0 to the first input.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.Duhem\">Operators.BaseClasses.Duhem</a>: equation, source, example.</p>
</html>"));
end Duhem;
