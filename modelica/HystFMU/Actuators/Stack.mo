within HystFMU.Actuators;
model Stack "Piezo stack with any identified hysteresis"
  extends BaseClasses.Piezo;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> as in <a href=\"modelica://HystFMU.Actuators.BaseClasses.Piezo\">Actuators.BaseClasses.Piezo</a>.</p>
<p><b>Heat:</b> as in Actuators.BaseClasses.Piezo; at least 0 at every instant with the default hysteresis.</p>
<p><b>Source:</b> as for the base class.</p>
<p><b>Limitations:</b> as for the base class; m is about a third of the mass of the ceramic.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.StackMovesMass\">Examples.StackMovesMass</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.DataSheet\">Actuators.DataSheet</a>, <a href=\"modelica://HystFMU.Actuators.FlexureAmplifier\">Actuators.FlexureAmplifier</a>, <a href=\"modelica://HystFMU.Actuators.VoltageDrive\">Actuators.VoltageDrive</a>, <a href=\"modelica://HystFMU.Actuators.ChargeDrive\">Actuators.ChargeDrive</a>.</p>
</html>"));
end Stack;
