within HystFMU.Operators.Smooth;
block ConstraintFactor "Constraint-factor operator (Ma): odd polynomial branch, smooth"
  extends BaseClasses.ConstraintFactor(final usesRate = true);
  extends Interfaces.Rated;
  parameter Integer plays(min = 2) = 50 "Number of plays that stand for the branch" annotation (Dialog(group = "Realisation"));
  parameter Real reach(min = 0) = min(4, d_max) "Longest branch that is met; a straight line beyond" annotation (Dialog(group = "Realisation"));
  parameter Real width(min = 0) = 2.5e-4*reach "Input on which the corner of a play is rounded, greater than 0: the bound of the error of a play" annotation (Dialog(group = "Realisation"));
protected
  parameter Real r[plays] = linspace(0, 0.5*reach*(1 - 1/plays), plays) "Half-widths";
  parameter Real q[plays + 1] = linspace(0, 0.5*reach, plays + 1) "Corners of the loading curve";
  parameter Real w[plays] = Functions.playWeights(Functions.constraintFactorLoading(q, a0, a, d_max), 0.5*reach/plays) "Weights";
  Real z[plays] "Plays";
initial equation
  z = Functions.play(x, r, fill(x0, plays));
equation
  assert(reach > 0 and width > 0 and width < 0.5*reach, "reach must be greater than 0, and width between 0 and half of it");
  assert(noEvent(abs(x - x0) <= 0.5*reach), "x is further from x0 than half of reach: branches become straight lines there; give a longer reach", AssertionLevel.warning);
  connect(dx, rate) annotation (Line(points = {{-110, -70}, {-80, -70}}, color = {0, 0, 127}));
  assert(memory == Types.Memory.dominant, "the realisation Smooth has memory = dominant only");
  for i in 1:plays loop
    der(z[i]) = Functions.playRate(x, rate, r[i], z[i], width);
  end for;
  h = w*(z - fill(x0, plays));
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> the branch must not fall between 0 and d_max (the unit checks it); the time of a step grows with depth. The branch is a polygon of <em>plays</em> straight pieces over <em>reach</em>. The parameter depth has no effect here.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.ConstraintFactor\">Operators.BaseClasses.ConstraintFactor</a>: equation, source, example.</p>
</html>"));
end ConstraintFactor;
