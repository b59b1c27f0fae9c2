within HystFMU.Operators.BaseClasses;
partial block ZhaoTan "Zhao-Tan hysteretic operator: parameters and ports"
  extends Icons.Hysteresis;
  parameter Integer depth(min = 4) = 256 "Extrema that the memory holds";
  parameter Types.Memory memory = Types.Memory.dominant "Which extremum a branch starts from";
  parameter Real x0 = 0 "Initial memory: the operator rests at x = x0, h = 0";
  Interfaces.RealInput x "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput dx(unit = "1/s") if usesRate "Rate of x; Sampled has no such input" annotation (Placement(transformation(extent = {{-120, -80}, {-100, -60}})));
  Interfaces.RealOutput h "Output of the operator" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  constant Boolean usesRate = false "Is there an input for the rate?";
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> h = h_p + sgn(x - x_p) (1 - e<sup>-d</sup>) d, d = abs(x - x_p); virgin branch h = sgn(x - x0) g(2 abs(x - x0))/2.</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, section III.</p>
<p><b>Limitations:</b> what the realisations have in common, for replaceable components to be constrained by.</p>
<p><b>Example:</b> <code>replaceable Operators.Sampled.ZhaoTan hysteresis constrainedby Operators.BaseClasses.ZhaoTan;</code></p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.ZhaoTan\">Operators.Sampled.ZhaoTan</a>, <a href=\"modelica://HystFMU.Operators.Events.ZhaoTan\">Operators.Events.ZhaoTan</a>, <a href=\"modelica://HystFMU.Operators.Smooth.ZhaoTan\">Operators.Smooth.ZhaoTan</a>.</p>
</html>"));
end ZhaoTan;
