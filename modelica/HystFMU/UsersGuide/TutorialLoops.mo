within HystFMU.UsersGuide;
package TutorialLoops "Tutorial: a hysteresis loop"
  extends Icons.Information;
  annotation (preferredView = "info", DocumentationClass = true, Documentation(info = "<html>
<p>Open <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>, simulate it and plot <code>events.y</code> over <code>signal.r</code>. Two tones make small loops
within a large one; each closes where it began.</p>
<p><img src=\"modelica://HystFMU/Resources/Images/MinorLoops.svg\" alt=\"output over input: small loops within a large one\"/></p>
<p>To change the loop: <code>r</code> are the half-widths of the plays, <code>w</code> their weights, <code>w0</code> is the slope at a reversal.
A wider loop has larger <code>r</code>. Widths and slopes of corners follow <code>r</code> by themselves, so that micrometres may be given in metres.</p>
<p>Next: <a href=\"modelica://HystFMU.UsersGuide.TutorialRealisations\">UsersGuide.TutorialRealisations</a>.</p>
</html>"));
end TutorialLoops;
