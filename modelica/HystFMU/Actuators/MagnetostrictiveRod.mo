within HystFMU.Actuators;
model MagnetostrictiveRod "Magnetostrictive rod in a coil, with any identified hysteresis"
  extends BaseClasses.Magnetostrictive;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> as in <a href=\"modelica://HystFMU.Actuators.BaseClasses.Magnetostrictive\">Actuators.BaseClasses.Magnetostrictive</a>.</p>
<p><b>Source:</b> as for the base class.</p>
<p><b>Limitations:</b> as for the base class.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MagnetostrictiveRod\">Examples.MagnetostrictiveRod</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.CurrentDrive\">Actuators.CurrentDrive</a>, <a href=\"modelica://HystFMU.Actuators.Stack\">Actuators.Stack</a>.</p>
</html>"));
end MagnetostrictiveRod;
