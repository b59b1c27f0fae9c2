within HystFMU.Dynamics;
block Differentiator "Filtered derivative of a signal"
  extends BaseClasses.Differentiator(du(start = 0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real u_last(start = 0, fixed = true) "Input at the last sample";
equation
  when sample(0, Ts) then
    du = if time < 0.5*Ts then 0 else (tau*pre(du) + u - pre(u_last))/(tau + Ts);
    u_last = u;
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> 0 until a step has been made; the simulation must start at time 0.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.BaseClasses.Differentiator\">Dynamics.BaseClasses.Differentiator</a>: equation, source, example.</p>
</html>"));
end Differentiator;
