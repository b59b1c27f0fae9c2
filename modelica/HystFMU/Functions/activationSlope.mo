within HystFMU.Functions;
function activationSlope "Slope of the activation of a neuron"
  extends Icons.Function;
  input Real s "Weighted sum";
  input Types.Activation kind "Activation";
  output Real slope "Derivative of the activation";
protected
  Real t "Hyperbolic tangent";
algorithm
  t := tanh(if kind == Types.Activation.sigmoid then 0.5*s else s);
  slope := if kind == Types.Activation.sigmoid then 0.25*(1 - t^2) elseif kind == Types.Activation.tanh then 1 - t^2 elseif s > 0 then 1 else 0;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> f(s) (1 - f(s)) of a sigmoid, 1 - tanh<sup>2</sup>(s), and 1 or 0 of a rectifier.</p>
<p><b>Smoothness:</b> the slope of a rectifier jumps at 0.</p>
<p><b>Source:</b> the usual definitions.</p>
<p><b>Smoothness:</b> the slope of relu jumps at 0.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>activationSlope(f[i], activation)</code> in <a href=\"modelica://HystFMU.Actuators.Hysteresis.PlayBankMlp\">Actuators.Hysteresis.PlayBankMlp</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.Hysteresis.PlayBankMlp\">Actuators.Hysteresis.PlayBankMlp</a>, which uses it.</p>
</html>"));
end activationSlope;
