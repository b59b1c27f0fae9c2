within HystFMU.Control;
block Feedforward "Feed-forward: inverse of a second-order plant"
  extends BaseClasses.Feedforward;
protected
  parameter Real omega_n(unit = "rad/s") = 6.283185307179586*f_n "Natural angular frequency";
equation
  v = (r + 2*zeta/omega_n*dr + ddr/omega_n^2)/gain;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> needs a reference with two derivatives; the plant must be of second order without zeros.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.BaseClasses.Feedforward\">Control.BaseClasses.Feedforward</a>: equation, source, example.</p>
</html>"));
end Feedforward;
