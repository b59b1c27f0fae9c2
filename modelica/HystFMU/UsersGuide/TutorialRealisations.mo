within HystFMU.UsersGuide;
package TutorialRealisations "Tutorial: which realisation"
  extends Icons.Information;
  annotation (preferredView = "info", DocumentationClass = true, Documentation(info = "<html>
<p>The operator has three realisations. <a href=\"modelica://HystFMU.Operators.Sampled\">Operators.Sampled</a> holds its
output between samples (the steps), <a href=\"modelica://HystFMU.Operators.Events\">Operators.Events</a> and
<a href=\"modelica://HystFMU.Operators.Smooth\">Operators.Smooth</a> follow the input (the curve).</p>
<p><img src=\"modelica://HystFMU/Resources/Images/Realisations.svg\" alt=\"output over time: steps of the sampled operator around the curve of the continuous ones\"/></p>
<p>Use <em>Sampled</em> for a controller, or to reproduce a unit. Use <em>Events</em> for a plant in continuous time; it
is exact and has one event per reversal. Use <em>Smooth</em> for a solver without events. For ten plays and two tones,
Events takes about twice the time of Smooth. To change the realisation in a model, right-click a replaceable component
and choose from the list, or write
<code>redeclare Operators.Events.PrandtlIshlinskii hysteresis</code>.</p>
<p>Details: <a href=\"modelica://HystFMU.UsersGuide.Realisations\">UsersGuide.Realisations</a>. Next: <a href=\"modelica://HystFMU.UsersGuide.TutorialExport\">UsersGuide.TutorialExport</a>.</p>
</html>"));
end TutorialRealisations;
