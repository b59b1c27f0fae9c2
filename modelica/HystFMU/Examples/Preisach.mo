within HystFMU.Examples;
model Preisach "Feed-forward and implicit inverse of a Preisach actuator, no feedback"
  extends Loops.Tracking(redeclare Loops.PreisachInverse inverse(Ts = Ts), redeclare Loops.PreisachPlant plant(Ts = Ts));
  annotation (experiment(StopTime = 0.2, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>The operator has no inverse in closed form; a root is computed at every sample. The remaining error is due to the hold of the command.</p>
<p><b>Source:</b> structure of the classes below; values chosen for this library.</p>
<p><b>Limitations:</b> the inverse has the exact Everett function.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Loops.PreisachPlant\">Loops.PreisachPlant</a>, <a href=\"modelica://HystFMU.Loops.PreisachInverse\">Loops.PreisachInverse</a>, <a href=\"modelica://HystFMU.Loops.Tracking\">Loops.Tracking</a>.</p>
</html>"));
end Preisach;
