within HystFMU.Operators.Sampled;
block ZhaoTan "Zhao-Tan hysteretic operator, sampled"
  extends BaseClasses.ZhaoTan(h(start = 0, fixed = true));
  extends Interfaces.Sampled;
protected
  parameter Boolean last = memory == Types.Memory.last "Only the last extremum is remembered";
  parameter Real virgin = if memory == Types.Memory.dominant then 2 else 1 "Scale of the virgin branch";
  discrete Real extrema[3 + 2*depth](start = cat(1, {0, 0, x0}, zeros(2*depth)), each fixed = true) "Extrema of x";
equation
  when sample(0, Ts) then
    extrema = Functions.turn(x, x0, pre(h), pre(extrema), last);
    h = Functions.zhaoTan(x, Functions.branchOrigin(extrema, x0, 0, virgin));
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> h = h_p + sgn(x - x_p) (1 - e<sup>-d</sup>) d, d = abs(x - x_p); virgin branch h = sgn(x - x0) g(2 abs(x - x0))/2.</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, section III.</p>
<p><b>Limitations:</b> Acts at 0, Ts, 2 Ts, ...: the unit of the same name stepped with Ts; extrema between two samples are not seen; memory = last is for replicas only: it drifts under noise and is unbounded on random reversals. The time of a step grows with depth (16 is enough for most loops).</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Events.ZhaoTan\">Operators.Events.ZhaoTan</a>, <a href=\"modelica://HystFMU.Operators.Smooth.ZhaoTan\">Operators.Smooth.ZhaoTan</a>, <a href=\"modelica://HystFMU.Validation.Sampled.ZhaoTan\">Validation.Sampled.ZhaoTan</a>.</p>
</html>"));
end ZhaoTan;
