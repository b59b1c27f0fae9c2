within HystFMU.Operators;
block ZhaoTan "Zhao-Tan hysteretic operator"
  extends Interfaces.Sampled;
  parameter Integer depth(min = 4) = 256 "Extrema that the memory holds";
  parameter Types.Memory memory = Types.Memory.dominant "Which extremum a branch starts from";
  parameter Real x0 = 0 "Initial memory: the operator rests at x = x0, h = 0";
  Interfaces.RealInput x "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput h(start = 0, fixed = true) "Output of the operator" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  parameter Real virgin = if memory == Types.Memory.dominant then 2 else 1 "Scale of the virgin branch";
  discrete Real extrema[3 + 2*depth](start = cat(1, {0, 0, x0}, zeros(2*depth)), each fixed = true) "Extrema of x";
equation
  when sample(0, Ts) then
    extrema = if memory == Types.Memory.dominant then Functions.turn(x, x0, pre(h), pre(extrema)) else Functions.turnLast(x, pre(h), pre(extrema));
    h = Functions.zhaoTan(x, Functions.branchOrigin(extrema, x0, 0, virgin));
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> h = h_p + sgn(x - x_p) (1 - e<sup>-d</sup>) d, d = abs(x - x_p); virgin branch h = sgn(x - x0) g(2 abs(x - x0))/2.</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, section III.</p>
<p><b>Limitations:</b> memory = last is for replicas only: it drifts under noise and is unbounded on random reversals. The time of a step grows with depth (16 is enough for most loops).</p>
</html>"));
end ZhaoTan;
