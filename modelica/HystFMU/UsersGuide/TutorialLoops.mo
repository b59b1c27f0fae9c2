within HystFMU.UsersGuide;
package TutorialLoops "Tutorial: a hysteresis loop"
  extends Icons.Information;
  annotation (preferredView = "info", DocumentationClass = true, Documentation(info = "<html>
<p>Open <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>, simulate it and plot
<code>events.y</code> over <code>signal.r</code>. Two tones cause small loops within a large loop; each small loop
closes at its start.</p>
<p><img src=\"modelica://HystFMU/Resources/Images/MinorLoops.svg\" alt=\"output over input: small loops within a large one\"/></p>
<p>To change the loop, change the half-widths <code>r</code> of the plays, their weights <code>w</code>, and the slope
<code>w0</code> at a reversal. Larger <code>r</code> make the loop wider. The widths of rounded corners are computed
from <code>r</code>, so any unit of measure is possible.</p>
<p>Next: <a href=\"modelica://HystFMU.UsersGuide.TutorialRealisations\">UsersGuide.TutorialRealisations</a>.</p>
</html>"));
end TutorialLoops;
