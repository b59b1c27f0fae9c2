within HystFMU.Dynamics;
block Differentiator "Filtered derivative of a signal"
  extends Icons.Block;
  extends Interfaces.Sampled;
  parameter Types.Time tau(min = 0) = 0 "Time constant of the filter; 0: plain difference";
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput du(unit = "1/s", start = 0, fixed = true) "Its derivative" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  discrete Real u_last(start = 0, fixed = true) "Input at the last sample";
equation
  when sample(0, Ts) then
    du = if time < 0.5*Ts then 0 else (tau*pre(du) + u - pre(u_last))/(tau + Ts);
    u_last = u;
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> du_k = (tau du_(k-1) + u_k - u_(k-1))/(tau + Ts).</p>
<p><b>Source:</b> Astrom &amp; Hagglund, PID Controllers, 2nd ed. 1995, section 3.6 (backward differences).</p>
<p><b>Limitations:</b> 0 until a step has been made; the simulation must start at time 0.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Differentiator\">Validation.Differentiator</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.RateFilter\">Dynamics.RateFilter</a>.</p>
</html>"));
end Differentiator;
