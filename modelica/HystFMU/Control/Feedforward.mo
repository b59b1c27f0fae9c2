within HystFMU.Control;
block Feedforward "Feed-forward: inverse of a second-order plant"
  extends Icons.Block;
  parameter Types.Frequency f_n(min = 0) = 500 "Natural frequency omega_n/2 pi";
  parameter Real zeta(min = 0) = 0.7 "Damping ratio";
  parameter Real gain = 1 "Gain of the plant at rest, not 0";
  Interfaces.RealInput r "Reference" annotation (Placement(transformation(extent = {{-120, 50}, {-100, 70}})));
  Interfaces.RealInput dr(unit = "1/s") "Its first derivative" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput ddr(unit = "1/s2") "Its second derivative" annotation (Placement(transformation(extent = {{-120, -70}, {-100, -50}})));
  Interfaces.RealOutput v "Input of the plant that gives r" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  parameter Real omega_n(unit = "rad/s") = 6.283185307179586*f_n "Natural angular frequency";
equation
  v = (r + 2*zeta/omega_n*dr + ddr/omega_n^2)/gain;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> v = (r + 2 zeta/omega_n r' + r''/omega_n<sup>2</sup>)/gain, omega_n = 2 pi f_n.</p>
<p><b>Source:</b> inverse of G0(s): Yu &amp; Alici 2005.</p>
<p><b>Limitations:</b> needs a reference with two derivatives; the plant must be of second order without zeros.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.Cascade\">Examples.Cascade</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.Pid\">Control.Pid</a>, <a href=\"modelica://HystFMU.Control.SlidingMode\">Control.SlidingMode</a>.</p>
</html>"));
end Feedforward;
