within HystFMU.Dynamics;
block Delay "Delay by a whole number of steps"
  extends Icons.Block;
  extends Interfaces.Sampled;
  parameter Integer n(min = 1) = 1 "Steps of delay";
  parameter Real y0 = 0 "Output until the first input has come through";
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y(start = y0, fixed = true) "Input n steps ago" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  discrete Real inputs[n](each start = y0, each fixed = true) "The last inputs, newest first";
equation
  when sample(0, Ts) then
    y = pre(inputs[n]);
    inputs = Functions.shift(u, pre(inputs));
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y_k = u_(k-n).</p>
<p><b>Source:</b> definition of the shift operator.</p>
<p><b>Limitations:</b> the time of a step grows with n.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Delay\">Validation.Delay</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.TransferFunction\">Dynamics.TransferFunction</a>.</p>
</html>"));
end Delay;
