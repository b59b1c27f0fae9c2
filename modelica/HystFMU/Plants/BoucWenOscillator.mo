within HystFMU.Plants;
block BoucWenOscillator "Oscillator with a Bouc-Wen force: the hysteretic benchmark plant"
  extends BaseClasses.BoucWenOscillator(y(start = 0, fixed = true, nominal = 1e-3), z(start = 0, fixed = true, nominal = 10));
  Types.Velocity v(start = 0, fixed = true) "Velocity";
equation
  der(y) = v;
  m_L*der(v) = u - c_L*v - k_L*y - z;
  der(z) = noEvent(alpha*v - beta*(gamma*abs(v)*(if z >= 0 then 1 else -1) + delta*v)*abs(z)^nu);
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> the block is continuous; the solver determines its accuracy. The unit uses Newmark's method of second order.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Plants.BaseClasses.BoucWenOscillator\">Plants.BaseClasses.BoucWenOscillator</a>: equation, source, example.</p>
</html>"));
end BoucWenOscillator;
