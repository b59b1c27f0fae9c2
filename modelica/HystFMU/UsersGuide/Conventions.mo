within HystFMU.UsersGuide;
package Conventions "Conventions"
  extends Icons.Information;
  annotation (preferredView = "info", DocumentationClass = true, Documentation(info = "<html>
<p><b>Names.</b> If a class corresponds to a HystFMU unit, names, units, ranges and defaults are the same. Dimensionless
quantities, and quantities in units that you choose, have the type Real. Times, frequencies and physical ports have SI
units.</p>
<p><b>Base classes.</b> Such a class extends the class with the same name in BaseClasses. This base class contains
parameters, ports, equation and source from the table of the unit. The class itself contains equations and
limitations.</p>
<p><b>Order.</b> A loop needs a block without direct feed-through, for example a delay, or a transfer function whose
numerator has a lower degree than its denominator.</p>
<p><b>Linear dynamics</b> are continuous here and discretised exactly in the unit. Just before the next sample, their
values are those of the unit if the input is held over the step. Dynamics.StateSpace is the discretised form.</p>
<p><b>Memory.</b> The parameter depth is the maximum number of extrema that an operator stores. The default is 16 here
and 256 in the unit. The computing time of a step is proportional to depth; 16 is enough for most loops.</p>
<p><b>Implicit inverse.</b> The unit inverts any graph between its ports u and h. Here the model is a package of
functions
(Inverse.BaseClasses.StaticModel): The packages of the operators are in Inverse.Models; <code>hystfmu export
--modelica</code> writes the package of an identified model.</p>
<p><b>Start.</b> Sampled blocks with a rule for the first sample assume that the simulation starts at time 0.</p>
</html>"));
end Conventions;
