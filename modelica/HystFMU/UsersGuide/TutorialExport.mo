within HystFMU.UsersGuide;
package TutorialExport "Tutorial: a model of your data"
  extends Icons.Information;
  annotation (preferredView = "info", DocumentationClass = true, Documentation(info = "<html>
<p><code>hystfmu fit piezo.csv -o piezo.model.toml</code> and <code>hystfmu export piezo.model.toml --modelica DIR</code> write a package with</p>
<ul>
<li><em>Values</em>, a record with all numbers;</li>
<li><em>Model</em>, <em>Events</em> and <em>Smooth</em>, the realisations; if a kind of model lacks a realisation, its
documentation states the reason;</li>
<li><em>Ports</em>, the base class of the realisations, with ports in SI units for any units of measure of the
data;</li>
<li><em>Example</em>, a model that can be simulated; its component <code>tested</code> is replaceable.</li>
</ul>
<p>A loop around it looks like this, <a href=\"modelica://HystFMU.Loops.Tracking\">Loops.Tracking</a>; <a href=\"modelica://HystFMU.Examples.Pid\">Examples.Pid</a> fills its slots:</p>
<p><img src=\"modelica://HystFMU/Resources/Images/Tracking.svg\" alt=\"diagram of Loops.Tracking\"/></p>
<p><code>model WithEvents = Piezo.Example(redeclare Piezo.Events tested);</code> simulates the same model with events.
The input <code>du</code> is the rate of <code>u</code>; the realisation Model has no such input, so the connection to
it is removed.</p>
<p>Next: <a href=\"modelica://HystFMU.UsersGuide.TutorialActuator\">UsersGuide.TutorialActuator</a>.</p>
</html>"));
end TutorialExport;
