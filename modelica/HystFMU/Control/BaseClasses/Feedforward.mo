// generated from the table of fmu_build/core/blocks/controllers/feedforward.c by `make generate` - do not edit
within HystFMU.Control.BaseClasses;
partial block Feedforward "Feed-forward: inverse of a second-order plant: parameters and ports"
  extends Icons.Block;
  parameter Types.Frequency f_n(min = 0) = 500 "Natural frequency omega_n / 2 pi; greater than 0" annotation (Dialog(group = "Dynamics"));
  parameter Real zeta(min = 0) = 0.7 "Damping ratio" annotation (Dialog(group = "Dynamics"));
  parameter Real gain = 1 "Static gain of the plant, not 0" annotation (Dialog(group = "Gains"));
  Interfaces.RealInput r "Reference" annotation (Placement(transformation(extent = {{-120, 43}, {-100, 63}})));
  Interfaces.RealInput dr(unit = "1/s") "First derivative of r" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput ddr(unit = "1/s2") "Second derivative of r" annotation (Placement(transformation(extent = {{-120, -64}, {-100, -44}})));
  Interfaces.RealOutput v "Plant input for the output r" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> v = (r + 2 zeta / omega_n r' + r'' / omega_n<sup>2</sup>) / gain, omega_n = 2 pi f_n.</p>
<p><b>Source:</b> inverse of G0(s): Yu &amp; Alici 2005 (plant H -&gt; G0).</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Feedforward\">Validation.Feedforward</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.Feedforward\">Control.Feedforward</a>.</p>
</html>"));
end Feedforward;
