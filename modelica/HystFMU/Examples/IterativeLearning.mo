within HystFMU.Examples;
model IterativeLearning "Iterative learning control of a hysteretic actuator with inverse"
  extends Loops.Tracking(reference(frequency = 100), redeclare Control.IterativeLearning controller(n = 100, gain = 0.7, lead = 6, smooth = 0.1, Ts = Ts) "One period of 100 Hz");
  annotation (experiment(StopTime = 0.1, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>The error decreases from period to period: plot plant.y - reference.r. There is no feedback within a period.</p>
<p><b>Source:</b> the scenario iterative_learning.</p>
<p><b>Limitations:</b> only the case of the scenario with ten periods of a sine of 100 Hz, without disturbance and noise.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Loops.Tracking\">Loops.Tracking</a>, <a href=\"modelica://HystFMU.Examples.Cascade\">Examples.Cascade</a>, <a href=\"modelica://HystFMU.Control.IterativeLearning\">Control.IterativeLearning</a>.</p>
</html>"));
end IterativeLearning;
