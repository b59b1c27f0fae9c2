within HystFMU.Loops;
block OpenLoop "No feedback: the feed-forward alone"
  extends Interfaces.Controller;
equation
  u = u_ff;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> u = u_ff; reference and measured output are not used.</p>
<p><b>Source:</b> none.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.Cascade\">Examples.Cascade</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Loops.Tracking\">Loops.Tracking</a>.</p>
</html>"));
end OpenLoop;
