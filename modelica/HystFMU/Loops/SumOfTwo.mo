within HystFMU.Loops;
block SumOfTwo "Weighted sum of two signals"
  extends Icons.Block;
  parameter Real k1 = 1 "Weight of the first input" annotation (Dialog(group = "Parameters"));
  parameter Real k2 = 1 "Weight of the second input" annotation (Dialog(group = "Parameters"));
  Interfaces.RealInput u1 "First input" annotation (Placement(transformation(extent = {{-120, 30}, {-100, 50}})));
  Interfaces.RealInput u2 "Second input" annotation (Placement(transformation(extent = {{-120, -50}, {-100, -30}})));
  Interfaces.RealOutput y "Output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
equation
  y = k1*u1 + k2*u2;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = k1 u1 + k2 u2.</p>
<p><b>Source:</b> definition.</p>
<p><b>Limitations:</b> none. After sampled blocks, this block replaces Dynamics.Sum, because rumoca 0.10.2 evaluates a vector input as a whole.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Loops.BoucWenPlant\">Loops.BoucWenPlant</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.Sum\">Dynamics.Sum</a>.</p>
</html>"));
end SumOfTwo;
