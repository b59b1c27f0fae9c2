within HystFMU.Examples;
model SlidingMode "Sliding mode control of a hysteretic actuator with integral action and inverse feed-forward"
  extends Loops.Tracking(redeclare Control.SlidingMode controller(lam = 1719, eta = 0.0003106, rho = 0.0001304, epsilon = 24.21, k_i = 14330000, Ts = Ts));
  annotation (
    experiment(StopTime = 0.2, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>At every sample, the controller reads the displacement and adds its correction to the feed-forward. The hysteresis of
the actuator follows without delay; the dynamics are continuous. The units have the same order if the dynamics step
first (Gauss-Seidel). Both results agree to the accuracy of the solver.</p>
<p><b>Source:</b> Yu &amp; Alici 2005, with integral action; plant: ten backlash operators and a linear term before G0(s), 500 Hz,
damping 0.7.</p>
<p><b>Limitation:</b> only the case sine_10 of the scenario sliding_mode, without disturbance and noise.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Loops.Tracking\">Loops.Tracking</a>.</p>
</html>"));
end SlidingMode;
