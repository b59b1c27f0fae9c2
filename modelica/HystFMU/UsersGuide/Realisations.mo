within HystFMU.UsersGuide;
package Realisations "Realisations Sampled, Events and Smooth"
  extends Icons.Information;
  annotation (preferredView = "info", DocumentationClass = true, Documentation(info = "<html>
<p><b>Sampled</b> acts at 0, Ts, 2 Ts, ... and holds its output in between: it behaves like the unit of the same name,
except for rounding errors. Blocks in series must have the same Ts. Extrema between two samples have no effect. Use it
for controllers, and for models that must agree with a unit.</p>
<p><b>Events</b> changes its memory where the input turns: there is one event per reversal and no event on a plateau.
Between events, the output is a closed form of the input. It needs only the sign of the rate of the input. Use it for
plants in continuous time. Replace jumps by ramps; the steps of the solver must not be longer than the time between two
reversals. The memory is full later than that of Sampled with the same depth.</p>
<p><b>Smooth</b> is an ordinary differential equation without events, for solvers and optimisers that do not support
events. It needs the value of the rate of the input. Plays have rounded corners; their error is at most
<code>width</code>. Bouc-Wen, Coleman-Hodgdon, Duhem, Jiles-Atherton and creep are differential equations without
approximation. For Zhao-Tan and Ma, the branch is a polygon with <code>plays</code> pieces over <code>reach</code>.</p>
<p>The rate comes from a source (dr_lead with lead = 0), from a state equation (the relaxation of a polarisation, see Actuators.BaseClasses.Piezo), or from
Dynamics.RateFilter. No input is differentiated by der().</p>
<p>To change the realisation, write <code>replaceable Operators.Sampled.PlayBank plays constrainedby
Operators.BaseClasses.PlayBank</code>, then redeclare.
The port of the rate is conditional; without the port, connections to it are removed.</p>
</html>"));
end Realisations;
