within HystFMU.Operators.Events;
block ColemanHodgdon "Coleman-Hodgdon operator, events at reversals"
  extends BaseClasses.ColemanHodgdon(final usesRate = true);
  extends Interfaces.Reversals(eps = 1e-9/alpha);
protected
  discrete Real u_turn(start = u0, fixed = true) "Input at the last reversal";
  discrete Real w_turn(start = y0 - b*u0, fixed = true) "y - b u at the last reversal";
equation
  connect(du, rate) annotation (Line(points = {{-110, -70}, {-80, -70}}, color = {0, 0, 127}));
  when {initial(), change(rising)} then
    w_turn = if initial() then Functions.colemanHodgdon(u, u0, y0 - b*u0, alpha, k - b) else Functions.colemanHodgdon(u, pre(u_turn), pre(w_turn), alpha, k - b);
    u_turn = u;
  end when;
  y = b*u + Functions.colemanHodgdon(u, u_turn, w_turn, alpha, k - b);
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> none.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.ColemanHodgdon\">Operators.BaseClasses.ColemanHodgdon</a>: equation, source, example.</p>
</html>"));
end ColemanHodgdon;
