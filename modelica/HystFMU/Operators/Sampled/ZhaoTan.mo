within HystFMU.Operators.Sampled;
block ZhaoTan "Zhao-Tan hysteretic operator, sampled"
  extends BaseClasses.ZhaoTan(h(start = 0, fixed = true));
  extends Interfaces.Sampled;
protected
  parameter Boolean last = memory == Types.Memory.last "True if only the last extremum is stored";
  parameter Real virgin = if memory == Types.Memory.dominant then 2 else 1 "Scale of the virgin branch";
  discrete Real extrema[3 + 2*depth](start = cat(1, {0, 0, x0}, zeros(2*depth)), each fixed = true) "Extrema of x";
equation
  when sample(t0, Ts) then
    extrema = Functions.turn(x, x0, pre(h), pre(extrema), last);
    h = Functions.zhaoTan(x, Functions.branchOrigin(extrema, x0, 0, virgin));
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> use memory = last only to reproduce the paper: the output drifts with noise and is unbounded for random reversals. The computing time of a step is proportional to depth; 16 is enough for most loops.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.ZhaoTan\">Operators.BaseClasses.ZhaoTan</a>: equation, source, example.</p>
</html>"));
end ZhaoTan;
