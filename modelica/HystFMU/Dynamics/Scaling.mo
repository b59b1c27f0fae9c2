within HystFMU.Dynamics;
block Scaling "Limit, gain and offset of each signal"
  extends BaseClasses.Scaling;
equation
  for i in 1:n loop
    assert(lo[i] <= hi[i], "lo must not be greater than hi");
    y[i] = min(hi[i], max(lo[i], u[i]))*gain[i] + offset[i];
  end for;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> none.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.BaseClasses.Scaling\">Dynamics.BaseClasses.Scaling</a>: equation, source, example.</p>
</html>"));
end Scaling;
