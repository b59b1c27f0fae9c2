within HystFMU.Examples;
model ZhaoTan "Feed-forward and the learned inverse of Zhao and Tan for a hysteretic actuator, no feedback"
  extends Loops.Tracking(redeclare Loops.ZhaoTanNetworkInverse inverse(Ts = Ts));
  annotation (experiment(StopTime = 0.2, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>The actuator is a sum of ten plays, not a Zhao-Tan operator. Therefore the network has an error of 0.24 % of the stroke; compare Examples.Cascade.</p>
<p><b>Source:</b> the case zhao_tan_sine_10 of the scenario cascade_learned; Zhao &amp; Tan 2008.</p>
<p><b>Limitations:</b> a sine of 10 Hz without disturbance and noise.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Loops.ZhaoTanNetworkInverse\">Loops.ZhaoTanNetworkInverse</a>, <a href=\"modelica://HystFMU.Loops.Tracking\">Loops.Tracking</a>, <a href=\"modelica://HystFMU.Examples.Cascade\">Examples.Cascade</a>.</p>
</html>"));
end ZhaoTan;
