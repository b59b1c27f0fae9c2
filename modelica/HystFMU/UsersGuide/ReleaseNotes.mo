within HystFMU.UsersGuide;
package ReleaseNotes "Release notes"
  extends Icons.Information;
  annotation (preferredView = "info", DocumentationClass = true, Documentation(info = "<html>
<p><b>0.2.0</b> Initial equations in place of reinit; start times other than 0; temperature ports in K; current-driven actuators,
a magnetostrictive rod, sensors; loops with plant, inverse and controller in slots.</p>
<p><b>0.1.0</b> First version: operators and inverses in three realisations, networks, dynamics, plants, controllers, sources, examples,
validation models with reference results, export of identified models.</p>
</html>"));
end ReleaseNotes;
