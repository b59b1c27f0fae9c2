within HystFMU.Examples;
model IterativeLearning "Iterative learning before the inverse on a hysteretic actuator"
  extends Loops.Tracking(reference(frequency = 100), redeclare Control.IterativeLearning controller(n = 100, gain = 0.7, lead = 6, smooth = 0.1, Ts = Ts) "One period of 100 Hz");
  annotation (experiment(StopTime = 0.1, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>From period to period the error shrinks: plot plant.y - reference.r. Within a period there is no feedback.</p>
<p><b>Source:</b> the scenario iterative_learning.</p>
<p><b>Limitations:</b> the case of the scenario with a sine of 100 Hz, ten of its periods: no disturbance, no noise.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Loops.Tracking\">Loops.Tracking</a>, <a href=\"modelica://HystFMU.Examples.Cascade\">Examples.Cascade</a>, <a href=\"modelica://HystFMU.Control.IterativeLearning\">Control.IterativeLearning</a>.</p>
</html>"));
end IterativeLearning;
