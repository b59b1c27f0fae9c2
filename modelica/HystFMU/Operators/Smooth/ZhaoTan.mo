within HystFMU.Operators.Smooth;
block ZhaoTan "Zhao-Tan hysteretic operator, smooth"
  extends BaseClasses.ZhaoTan(final usesRate = true);
  extends Interfaces.Rated;
  parameter Integer plays(min = 2) = 50 "Number of plays that approximate the branch" annotation (Dialog(group = "Realisation"));
  parameter Real reach(min = 0) = 4 "Longest branch, then a straight line" annotation (Dialog(group = "Realisation"));
  parameter Real width(min = 0) = 2.5e-4*reach "Width of the rounded corner of a play, greater than 0; the error of a play is at most width" annotation (Dialog(group = "Realisation"));
protected
  parameter Real r[plays] = linspace(0, 0.5*reach*(1 - 1/plays), plays) "Half-widths";
  parameter Real q[plays + 1] = linspace(0, 0.5*reach, plays + 1) "Inputs of the corners of the loading curve";
  parameter Real w[plays] = Functions.playWeights(Functions.zhaoTanLoading(q), 0.5*reach/plays) "Weights";
  Real z[plays] "Plays";
initial equation
  z = Functions.play(x, r, fill(x0, plays));
equation
  assert(reach > 0 and width > 0 and width < 0.5*reach, "reach must be greater than 0, and width between 0 and reach/2");
  assert(noEvent(abs(x - x0) <= 0.5*reach), "abs(x - x0) exceeds reach/2, where branches become straight lines: increase reach", AssertionLevel.warning);
  connect(dx, rate) annotation (Line(points = {{-110, -70}, {-80, -70}}, color = {0, 0, 127}));
  assert(memory == Types.Memory.dominant, "memory must be dominant for the realisation Smooth");
  for i in 1:plays loop
    der(z[i]) = Functions.playRate(x, rate, r[i], z[i], width);
  end for;
  h = w*(z - fill(x0, plays));
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> use memory = last only to reproduce the paper: the output drifts with noise and is unbounded for random reversals. The computing time of a step is proportional to depth; 16 is enough for most loops. The branch is a polygon; the parameter <em>plays</em> is the number of its straight pieces over <em>reach</em>. The parameter depth has no effect here.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.ZhaoTan\">Operators.BaseClasses.ZhaoTan</a>: equation, source, example.</p>
</html>"));
end ZhaoTan;
