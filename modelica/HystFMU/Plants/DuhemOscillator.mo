within HystFMU.Plants;
block DuhemOscillator "Oscillator with a Duhem force of any shape"
  extends BaseClasses.DuhemOscillator(y(start = 0, fixed = true, nominal = 1e-3), z(start = 0, fixed = true, nominal = 10));
  Types.Velocity v(start = 0, fixed = true) "Velocity";
protected
  Real x "Position among the knots, 0 at the first knot";
equation
  der(y) = v;
  m_L*der(v) = u - c_L*v - k_L*y - z;
  x = noEvent((n - 1)*(1 + (if v > 0 then z else -z)/z_max)/2);
  der(z) = noEvent(v*(f[1] + sum((f[i + 1] - f[i])*max(0.0, min(1.0, x - i + 1)) for i in 1:n - 1)));
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> the block is continuous; the solver determines its accuracy. The unit uses Verlet's method of second order.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Plants.BaseClasses.DuhemOscillator\">Plants.BaseClasses.DuhemOscillator</a>: equation, source, example.</p>
</html>"));
end DuhemOscillator;
