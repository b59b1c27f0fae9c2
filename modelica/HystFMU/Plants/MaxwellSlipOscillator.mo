within HystFMU.Plants;
block MaxwellSlipOscillator "Oscillator with Maxwell-slip friction"
  extends BaseClasses.MaxwellSlipOscillator(y(start = 0, fixed = true, nominal = 1e-3), z(nominal = 10));
  Types.Velocity v(start = 0, fixed = true) "Velocity";
  Types.Position s[n](each start = 0, each fixed = true) "Deflections of the springs with a slider";
equation
  der(y) = v;
  m_L*der(v) = u - c_L*v - k_L*y - z;
  z = sum(k[i]*noEvent(max(-r[i], min(r[i], s[i]))) for i in 1:n);
  for i in 1:n loop
    der(s[i]) = noEvent(if (if v > 0 then s[i] < r[i] else s[i] > -r[i]) then v else 0);
  end for;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> the block is continuous; the solver determines its accuracy. The unit uses Verlet's method of second order.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Plants.BaseClasses.MaxwellSlipOscillator\">Plants.BaseClasses.MaxwellSlipOscillator</a>: equation, source, example.</p>
</html>"));
end MaxwellSlipOscillator;
