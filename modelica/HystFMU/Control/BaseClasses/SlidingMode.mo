// generated from the table of fmu_build/core/blocks/controllers/sliding_mode.c by `make generate` - do not edit
within HystFMU.Control.BaseClasses;
partial block SlidingMode "Sliding mode controller with feed-forward, integral action and anti-windup: parameters and ports"
  extends Interfaces.Controller;
  parameter Real lam(unit = "1/s", min = 0) = 100 "Slope of the sliding line" annotation (Dialog(group = "Controller"));
  parameter Types.Time eta(min = 0) = 0 "Linear gain of s" annotation (Dialog(group = "Gains"));
  parameter Real rho(min = 0) = 0 "Switching gain" annotation (Dialog(group = "Gains"));
  parameter Real epsilon(unit = "1/s", min = 0) = 0 "Width of the boundary layer; 0: rho / (10 eta)" annotation (Dialog(group = "Controller"));
  parameter Types.Switching switching = Types.Switching.smooth "Law s / (|s| + epsilon) or sat(s / epsilon)" annotation (Dialog(group = "Controller"));
  parameter Real k_i(unit = "1/s2", min = 0) = 0 "Integral gain; 0: law of Yu & Alici 2005" annotation (Dialog(group = "Gains"));
  parameter Types.Time tau(min = 0) = 0 "Time constant of the filter of de/dt; 0: none" annotation (Dialog(group = "Filters"));
  parameter Real u_min = -1e300 "Lower limit of u" annotation (Dialog(group = "Limits"));
  parameter Real u_max = 1e300 "Upper limit of u" annotation (Dialog(group = "Limits"));
  Interfaces.RealOutput s(unit = "1/s") "Distance from the sliding line" annotation (Placement(transformation(extent = {{100, -50}, {120, -30}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> s = de/dt + lam e + k_i int e dt, e = y - y_d, u = u_ff - eta s - rho s / (|s| + epsilon) or u_ff - eta s - rho sat(s / epsilon).</p>
<p><b>Source:</b> Yu &amp; Alici 2005 (k_i = 0); integral sliding line and saturation: Slotine &amp; Li, Applied Nonlinear Control, 7.1 and 7.2.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.SlidingMode\">Examples.SlidingMode</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.SlidingMode\">Control.SlidingMode</a>, <a href=\"modelica://HystFMU.Validation.SlidingMode\">Validation.SlidingMode</a>.</p>
</html>"));
end SlidingMode;
