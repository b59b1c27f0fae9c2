// generated from the table of fmu_build/core/blocks/dynamics/in_range.c by `make generate` - do not edit
within HystFMU.Dynamics.BaseClasses;
partial block InRange "Test whether all signals are within their limits: parameters and ports"
  extends Icons.Block;
  parameter Integer n(min = 1) = 1 "Number of signals" annotation (Dialog(group = "Sizes"));
  parameter Real lo[n](each min = -1e300, each max = 1e300) = fill(-1.0, n) "Lower limit (-1e300: none)" annotation (Dialog(group = "Limits"));
  parameter Real hi[n](each min = -1e300, each max = 1e300) = fill(1.0, n) "Upper limit (1e300: none)" annotation (Dialog(group = "Limits"));
  Interfaces.RealInput u[n] "Signals" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y "1 if all signals are within their limits, else 0" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = 1 if lo_i &lt;= u_i &lt;= hi_i for all i, else 0.</p>
<p><b>Source:</b> definition.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.InRange\">Validation.InRange</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.InRange\">Dynamics.InRange</a>.</p>
</html>"));
end InRange;
