within HystFMU.Loops;
block Affine "Gain and offset of one signal"
  extends Icons.Block;
  parameter Real gain = 1 "Gain" annotation (Dialog(group = "Parameters"));
  parameter Real offset = 0 "Offset, added after the gain" annotation (Dialog(group = "Parameters"));
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y "Output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
equation
  y = gain*u + offset;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = gain u + offset.</p>
<p><b>Source:</b> affine normalisation.</p>
<p><b>Limitations:</b> none. Between sampled blocks, this block replaces Dynamics.Scaling, whose vector output is one sample late in rumoca 0.10.2.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Loops.IdentifiedInverse\">Loops.IdentifiedInverse</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.Scaling\">Dynamics.Scaling</a>.</p>
</html>"));
end Affine;
