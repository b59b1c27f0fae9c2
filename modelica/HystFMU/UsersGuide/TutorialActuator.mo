within HystFMU.UsersGuide;
package TutorialActuator "Tutorial: an actuator with physical ports"
  extends Icons.Information;
  annotation (preferredView = "info", DocumentationClass = true, Documentation(info = "<html>
<p><a href=\"modelica://HystFMU.Examples.StackMovesMass\">Examples.StackMovesMass</a>: a voltage drive, a stack with an identified hysteresis between two pins and two flanges, a load.</p>
<p><img src=\"modelica://HystFMU/Resources/Images/StackMovesMass.svg\" alt=\"diagram of Examples.StackMovesMass\"/></p>
<p>The pins and flanges carry the quantities of those of the Modelica Standard Library and connect to them. Nothing is differentiated: the
rate that the hysteresis needs is that of a state. The hysteresis is replaceable: choose another of <a href=\"modelica://HystFMU.Actuators.Hysteresis\">Actuators.Hysteresis</a>.
Plot <code>stack.flange_b.s</code> over <code>stack.pin_p.v</code>.</p>
</html>"));
end TutorialActuator;
