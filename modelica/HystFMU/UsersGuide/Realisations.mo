within HystFMU.UsersGuide;
package Realisations "Sampled, Events, Smooth"
  extends Icons.Information;
  annotation (preferredView = "info", DocumentationClass = true, Documentation(info = "<html>
<p><b>Sampled</b> acts at 0, Ts, 2 Ts, ... and holds its output in between: the semantics of the unit of the same name, equal to rounding.
Blocks in a chain must have the same Ts. Extrema between two samples are not seen. For controllers, and for models that shall
give what a unit gives.</p>
<p><b>Events</b> changes its memory where the input turns: one event for each reversal, none on a plateau, and between them a closed
form of the input. It needs the rate of the input, of which the sign alone counts. For plants in continuous time. A jump must be a
ramp, and the solver's steps must not be longer than the time between two reversals. A full memory (depth) forgets later
than that of Sampled.</p>
<p><b>Smooth</b> is an ordinary differential equation without events, for solvers and optimisers that want none. It needs the rate of
the input itself. Plays have a corner rounded over <code>width</code>, the bound of their error; Bouc-Wen, Coleman-Hodgdon, Duhem,
Jiles-Atherton and creep are differential equations anyhow. Zhao-Tan and Ma are a polygon of <code>plays</code> pieces over <code>reach</code>.</p>
<p>The rate comes from a source (dr_lead with lead = 0), from a state equation (the relaxation of a polarisation, see Actuators.BaseClasses.Piezo), or from
Dynamics.RateFilter. No input is differentiated by der().</p>
<p>To change over: <code>replaceable Operators.Sampled.PlayBank plays constrainedby Operators.BaseClasses.PlayBank</code>, then redeclare.
The port of the rate is conditional; a connection to it disappears with it.</p>
</html>"));
end Realisations;
