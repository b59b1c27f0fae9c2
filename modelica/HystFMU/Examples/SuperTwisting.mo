within HystFMU.Examples;
model SuperTwisting "Super-twisting control of a hysteretic actuator with inverse feed-forward"
  extends Loops.Tracking(redeclare Control.SuperTwisting controller(lam = 4133, k_1 = 0.0003779, k_2 = 14.39, mu = 0.1818, epsilon = 2137, Ts = Ts));
  annotation (experiment(StopTime = 0.2, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>The switching term is integrated, so the command is continuous. The controller is accurate if the design considers all delays of the loop.</p>
<p><b>Source:</b> the scenario super_twisting.</p>
<p><b>Limitations:</b> the case of the scenario with a sine of 10 Hz without disturbance and noise.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Loops.Tracking\">Loops.Tracking</a>, <a href=\"modelica://HystFMU.Examples.SlidingMode\">Examples.SlidingMode</a>, <a href=\"modelica://HystFMU.Control.SuperTwisting\">Control.SuperTwisting</a>.</p>
</html>"));
end SuperTwisting;
