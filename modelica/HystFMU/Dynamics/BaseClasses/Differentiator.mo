// generated from the table of fmu_build/core/blocks/dynamics/differentiator.c by `make generate` - do not edit
within HystFMU.Dynamics.BaseClasses;
partial block Differentiator "Filtered derivative of a signal: parameters and ports"
  extends Icons.Block;
  parameter Types.Time tau(min = 0) = 0 "Time constant of the filter; 0: plain difference" annotation (Dialog(group = "Filters"));
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput du(unit = "1/s") "Derivative of u" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> du_k = (tau du_(k-1) + u_k - u_(k-1)) / (tau + h).</p>
<p><b>Source:</b> Astrom &amp; Hagglund, PID Controllers, 2nd ed. 1995, section 3.6 (backward differences).</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Differentiator\">Validation.Differentiator</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.Differentiator\">Dynamics.Differentiator</a>.</p>
</html>"));
end Differentiator;
