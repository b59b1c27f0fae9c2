within HystFMU.Operators.Smooth;
block PrandtlIshlinskii "Prandtl-Ishlinskii operator: linear term plus weighted plays, smooth"
  extends BaseClasses.PrandtlIshlinskii(final usesRate = true);
  extends Interfaces.Rated;
  parameter Real width(min = 0) = 1e-3*max(max(r), 1e-300) "Width of the rounded corner of a play, greater than 0; the error of a play is at most width" annotation (Dialog(group = "Realisation"));
protected
  Real z[n] "Plays";
initial equation
  z = Functions.play(u, r, fill(u0, n));
equation
  assert(width > 0 and (max(r) <= 0 or width < max(r)), "width must be greater than 0 and less than the largest threshold in r");
  connect(du, rate) annotation (Line(points = {{-110, -70}, {-80, -70}}, color = {0, 0, 127}));
  for i in 1:n loop
    der(z[i]) = Functions.playRate(u, rate, r[i], z[i], width);
  end for;
  y = w0*u + w*z;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> all plays start from u0. The computing time of a step is proportional to depth; 16 is enough for most loops. A play differs from the exact play by at most width. The parameter depth has no effect here.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.PrandtlIshlinskii\">Operators.BaseClasses.PrandtlIshlinskii</a>: equation, source, example.</p>
</html>"));
end PrandtlIshlinskii;
