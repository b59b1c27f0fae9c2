within HystFMU.Operators.Events;
block ZhaoTan "Zhao-Tan hysteretic operator, events at reversals"
  extends BaseClasses.ZhaoTan(final usesRate = true);
  extends Interfaces.Reversals;
protected
  parameter Boolean last = memory == Types.Memory.last "True if only the last extremum is stored";
  parameter Real virgin = if memory == Types.Memory.dominant then 2 else 1 "Scale of the virgin branch";
  discrete Real extrema[3 + 2*depth](start = cat(1, {0, 0, x0}, zeros(2*depth)), each fixed = true) "Extrema of x";
  discrete Real h_turn(start = 0, fixed = true) "Output at the last reversal";
  Real current[3 + 2*depth] "Extrema without those that x has passed";
equation
  connect(dx, rate) annotation (Line(points = {{-110, -70}, {-80, -70}}, color = {0, 0, 127}));
  when {initial(), change(rising)} then
    extrema = Functions.turn(x, x0, pre(h_turn), pre(extrema), last);
    h_turn = Functions.zhaoTan(x, Functions.branchOrigin(extrema, x0, 0, virgin));
  end when;
  current = Functions.turn(x, x0, h_turn, extrema, last);
  h = Functions.zhaoTan(x, Functions.branchOrigin(current, x0, 0, virgin));
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> use memory = last only to reproduce the paper: the output drifts with noise and is unbounded for random reversals. The computing time of a step is proportional to depth; 16 is enough for most loops.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.ZhaoTan\">Operators.BaseClasses.ZhaoTan</a>: equation, source, example.</p>
</html>"));
end ZhaoTan;
