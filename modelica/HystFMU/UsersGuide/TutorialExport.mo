within HystFMU.UsersGuide;
package TutorialExport "Tutorial: a model of your own data"
  extends Icons.Information;
  annotation (preferredView = "info", DocumentationClass = true, Documentation(info = "<html>
<p><code>hystfmu fit piezo.csv -o piezo.model.toml</code> and <code>hystfmu export piezo.model.toml --modelica DIR</code> write a package with</p>
<ul>
<li><em>Values</em>, the record of all numbers;</li>
<li><em>Model</em>, <em>Events</em> and <em>Smooth</em>, the realisations; what a kind of model has not, its documentation says, with the reason;</li>
<li><em>Ports</em>, which they extend: ports in SI units, whatever the units of measure of the data;</li>
<li><em>Example</em>, ready to simulate; its component <code>tested</code> is replaceable.</li>
</ul>
<p>A loop around it looks like this, <a href=\"modelica://HystFMU.Loops.Tracking\">Loops.Tracking</a>; <a href=\"modelica://HystFMU.Examples.Pid\">Examples.Pid</a> fills its slots:</p>
<p><img src=\"modelica://HystFMU/Resources/Images/Tracking.svg\" alt=\"diagram of Loops.Tracking\"/></p>
<p><code>model WithEvents = Piezo.Example(redeclare Piezo.Events tested);</code> shows the same with events. The input <code>du</code> is the rate
of <code>u</code>; Model has no such input, and a connection to it disappears.</p>
<p>Next: <a href=\"modelica://HystFMU.UsersGuide.TutorialActuator\">UsersGuide.TutorialActuator</a>.</p>
</html>"));
end TutorialExport;
