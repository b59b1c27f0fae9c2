within HystFMU.Dynamics;
block InRange "Test whether all signals are within their limits"
  extends BaseClasses.InRange;
protected
  Real inside[n] "1 for each signal within its limits";
equation
  for i in 1:n loop
    assert(lo[i] <= hi[i], "lo must not be greater than hi");
    inside[i] = if u[i] >= lo[i] and u[i] <= hi[i] then 1 else 0;
  end for;
  y = min(inside);
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> none.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.BaseClasses.InRange\">Dynamics.BaseClasses.InRange</a>: equation, source, example.</p>
</html>"));
end InRange;
