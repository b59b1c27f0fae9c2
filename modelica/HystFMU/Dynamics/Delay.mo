within HystFMU.Dynamics;
block Delay "Delay by a whole number of steps"
  extends BaseClasses.Delay(y(start = y0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real inputs[n](each start = y0, each fixed = true) "The last inputs, newest first";
equation
  when sample(t0, Ts) then
    y = pre(inputs[n]);
    inputs = Functions.shift(u, pre(inputs));
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> the computing time of a step is proportional to n.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.BaseClasses.Delay\">Dynamics.BaseClasses.Delay</a>: equation, source, example.</p>
</html>"));
end Delay;
