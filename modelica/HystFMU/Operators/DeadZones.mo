within HystFMU.Operators;
block DeadZones "Weighted sum of one-sided dead zones"
  extends BaseClasses.DeadZones;
equation
  y = w0*u + w*Functions.deadZone(u, r);
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> no memory; in series with a sum of plays, the block makes the operator asymmetric.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.DeadZones\">Operators.BaseClasses.DeadZones</a>: equation, source, example.</p>
</html>"));
end DeadZones;
