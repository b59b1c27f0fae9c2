// generated from the table of fmu_build/core/blocks/controllers/super_twisting.c by `make generate` - do not edit
within HystFMU.Control.BaseClasses;
partial block SuperTwisting "Super-twisting sliding mode controller with feed-forward and anti-windup: parameters and ports"
  extends Interfaces.Controller;
  parameter Real lam(unit = "1/s", min = 0) = 100 "Slope of the sliding line" annotation (Dialog(group = "Controller"));
  parameter Real k_1(min = 0) = 0 "Gain of |s|^(1/2), in seconds^(1/2)" annotation (Dialog(group = "Gains"));
  parameter Real k_2(unit = "1/s", min = 0) = 0 "Gain of the integrated switching term" annotation (Dialog(group = "Gains"));
  parameter Real mu(min = 0) = 0 "Weight of the linear terms, in seconds^(1/2); 0: none" annotation (Dialog(group = "Weights"));
  parameter Real epsilon(unit = "1/s", min = 0) = 0 "Width of the boundary layer; 0: (10 k_2 / (lam k_1))^2" annotation (Dialog(group = "Controller"));
  parameter Types.Time tau(min = 0) = 0 "Time constant of the filter of de/dt; 0: none" annotation (Dialog(group = "Filters"));
  parameter Real u_min = -1e300 "Lower limit of u" annotation (Dialog(group = "Limits"));
  parameter Real u_max = 1e300 "Upper limit of u" annotation (Dialog(group = "Limits"));
  Interfaces.RealOutput s(unit = "1/s") "Distance from the sliding line" annotation (Placement(transformation(extent = {{100, -50}, {120, -30}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> s = de/dt + lam e, e = y - y_d; u = u_ff - k_1 (|s|<sup>1/2</sup> sgn s + mu s) - k_2 v, v' = sgn(s)/2 + 3/2 mu |s|<sup>1/2</sup> sgn s + mu<sup>2</sup> s; sgn s = s / (|s| + epsilon).</p>
<p><b>Source:</b> Levant, Int. J. Control 58 (1993) 1247; Moreno 2009, generalised super-twisting (linear terms).</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.SuperTwisting\">Examples.SuperTwisting</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.SuperTwisting\">Control.SuperTwisting</a>, <a href=\"modelica://HystFMU.Validation.SuperTwisting\">Validation.SuperTwisting</a>.</p>
</html>"));
end SuperTwisting;
