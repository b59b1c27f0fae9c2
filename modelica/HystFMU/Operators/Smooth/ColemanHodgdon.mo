within HystFMU.Operators.Smooth;
block ColemanHodgdon "Coleman-Hodgdon operator, smooth"
  extends BaseClasses.ColemanHodgdon(final usesRate = true);
  extends Interfaces.Rated;
protected
  Real w "y - b u";
initial equation
  w = Functions.colemanHodgdon(u, u0, y0 - b*u0, alpha, k - b);
equation
  connect(du, rate) annotation (Line(points = {{-110, -70}, {-80, -70}}, color = {0, 0, 127}));
  der(w) = (k - b)*rate - alpha*abs(rate)*w;
  y = b*u + w;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> none.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.ColemanHodgdon\">Operators.BaseClasses.ColemanHodgdon</a>: equation, source, example.</p>
</html>"));
end ColemanHodgdon;
