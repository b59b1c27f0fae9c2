within HystFMU.UsersGuide;
package TutorialRealisations "Tutorial: which realisation"
  extends Icons.Information;
  annotation (preferredView = "info", DocumentationClass = true, Documentation(info = "<html>
<p>The same operator three times: <a href=\"modelica://HystFMU.Operators.Sampled\">Operators.Sampled</a> holds its output between samples (the steps), <a href=\"modelica://HystFMU.Operators.Events\">Operators.Events</a> and
<a href=\"modelica://HystFMU.Operators.Smooth\">Operators.Smooth</a> follow the input (the curve).</p>
<p><img src=\"modelica://HystFMU/Resources/Images/Realisations.svg\" alt=\"output over time: steps of the sampled operator around the curve of the continuous ones\"/></p>
<p>A controller or what a unit gives: <em>Sampled</em>. A plant in continuous time: <em>Events</em>, exact, with one event at each
reversal. A solver that must not meet events: <em>Smooth</em>. Ten plays on two tones take about twice the time of Smooth with
events. To change over in a model: right-click a replaceable component, choose from the list, or write
<code>redeclare Operators.Events.PrandtlIshlinskii hysteresis</code>.</p>
<p>Details: <a href=\"modelica://HystFMU.UsersGuide.Realisations\">UsersGuide.Realisations</a>. Next: <a href=\"modelica://HystFMU.UsersGuide.TutorialExport\">UsersGuide.TutorialExport</a>.</p>
</html>"));
end TutorialRealisations;
