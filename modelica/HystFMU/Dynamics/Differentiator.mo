within HystFMU.Dynamics;
block Differentiator "Filtered derivative of a signal"
  extends BaseClasses.Differentiator(du(start = 0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real u_last(start = 0, fixed = true) "Input at the last sample";
equation
  when sample(t0, Ts) then
    du = if pre(begun) then (tau*pre(du) + u - pre(u_last))/(tau + Ts) else 0;
    u_last = u;
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> the output is 0 until the first step.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.BaseClasses.Differentiator\">Dynamics.BaseClasses.Differentiator</a>: equation, source, example.</p>
</html>"));
end Differentiator;
