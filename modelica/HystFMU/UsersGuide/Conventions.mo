within HystFMU.UsersGuide;
package Conventions "Conventions"
  extends Icons.Information;
  annotation (preferredView = "info", DocumentationClass = true, Documentation(info = "<html>
<p><b>Names.</b> A class with a twin among the HystFMU units carries its names, units, ranges and defaults. A quantity of dimension one, or one in
units of your own choice, is a plain Real; times, frequencies and physical ports have SI units.</p>
<p><b>Base classes.</b> Such a class extends the class of its name in BaseClasses, which has parameters, ports, equation and source
from the table of the unit. The class itself has equations and limitations.</p>
<p><b>Order.</b> A loop needs a block without direct feed-through: a transfer function whose numerator has a lower degree than its
denominator, or a delay.</p>
<p><b>Linear dynamics</b> are continuous here and discretised exactly in the unit; their values just before the next sample are those of the unit for
the input held over the step. Dynamics.StateSpace is the discretised form.</p>
<p><b>Memory.</b> depth is the number of extrema that an operator remembers. The default is 16, of the unit 256: a step takes time in proportion, and 16 is
enough unless loops are nested more deeply.</p>
<p><b>Implicit inverse.</b> The unit hangs on any graph between its ports u and h. Here the model is a package of functions
(Inverse.BaseClasses.StaticModel): those of the operators stand in Inverse.Models, that of an identified model comes from
<code>hystfmu export --modelica</code>.</p>
<p><b>Start.</b> Sampled blocks with a rule for the first sample take time 0 as the start of the simulation.</p>
</html>"));
end Conventions;
