within HystFMU.Dynamics;
block Sum "Weighted sum of signals"
  extends BaseClasses.Sum;
equation
  y = offset + k*u;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> none.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.BaseClasses.Sum\">Dynamics.BaseClasses.Sum</a>: equation, source, example.</p>
</html>"));
end Sum;
