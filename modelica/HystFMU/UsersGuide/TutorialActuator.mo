within HystFMU.UsersGuide;
package TutorialActuator "Tutorial: an actuator with physical ports"
  extends Icons.Information;
  annotation (preferredView = "info", DocumentationClass = true, Documentation(info = "<html>
<p><a href=\"modelica://HystFMU.Examples.StackMovesMass\">Examples.StackMovesMass</a>: a voltage drive, a stack with an
identified hysteresis, two pins and two flanges, and a load.</p>
<p><img src=\"modelica://HystFMU/Resources/Images/StackMovesMass.svg\" alt=\"diagram of Examples.StackMovesMass\"/></p>
<p>The pins and flanges have the same quantities as those of the Modelica Standard Library and can be connected to them.
No signal is differentiated, because the hysteresis uses the rate of a state. The hysteresis is replaceable by another
class of <a href=\"modelica://HystFMU.Actuators.Hysteresis\">Actuators.Hysteresis</a>.
Plot <code>stack.flange_b.s</code> over <code>stack.pin_p.v</code>.</p>
<p><a href=\"modelica://HystFMU.Examples.StackInLoop\">Examples.StackInLoop</a> closes a loop around the stack, with a sensor, the inverse and a controller of the library.
An exported actuator may replace the stack. In <a href=\"modelica://HystFMU.Loops.Tracking\">Loops.Tracking</a>,
amplifier, actuator and sensor are the plant.
The actuator of <a href=\"modelica://HystFMU.Examples.MagnetostrictiveRod\">Examples.MagnetostrictiveRod</a> has a
current drive. With blocks of the Modelica Standard Library, such a loop is</p>
<pre>
model WithStandardBlocks
  HystFMU.Sources.Sine reference(frequency = 10) \"In parts of the stroke\";
  Modelica.Blocks.Math.Feedback error;
  Modelica.Blocks.Continuous.PI controller(k = 0.3, T = 2e-4, initType = Modelica.Blocks.Types.Init.InitialState);
  HystFMU.Actuators.VoltageDrive drive(gain = 100, v_min = -130);
  HystFMU.Actuators.Stack stack(withMass = false);
  HystFMU.Plants.SpringMassLoad load(m = 0.2, c = 3000, k = 2e6);
  HystFMU.Plants.PositionSensor sensor;
  Modelica.Blocks.Math.Gain reading(k = 1.025/26e-6) \"From metres to parts of the stroke\";
  HystFMU.Plants.Ground ground;
  HystFMU.Plants.Fixed fixed;
equation
  connect(reference.r, error.u1);
  connect(reading.y, error.u2);
  connect(error.y, controller.u);
  connect(controller.y, drive.u);
  connect(drive.pin_p, stack.pin_p);
  connect(drive.pin_n, stack.pin_n);
  connect(drive.pin_n, ground.pin);
  connect(fixed.flange, stack.flange_a);
  connect(stack.flange_b, load.flange);
  connect(stack.flange_b, sensor.flange);
  connect(sensor.s, reading.u);
end WithStandardBlocks;
</pre>
</html>"));
end TutorialActuator;
