within HystFMU.Plants;
model VoltageDrive "Voltage amplifier with an output resistance"
  extends Icons.Component;
  parameter Real gain(unit = "V") = 100 "Volts for a command of 1" annotation (Dialog(group = "Parameters"));
  parameter Types.Resistance resistance(min = 0) = 50 "Output resistance" annotation (Dialog(group = "Parameters"));
  Interfaces.RealInput u "Command" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.Pin pin_p "Output" annotation (Placement(transformation(extent = {{100, 40}, {120, 60}})));
  Interfaces.Pin pin_n "Return; a circuit needs one ground" annotation (Placement(transformation(extent = {{100, -60}, {120, -40}})));
equation
  pin_p.i + pin_n.i = 0;
  pin_p.v - pin_n.v = gain*u + resistance*pin_p.i;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> v = gain u + R i, i into the amplifier.</p>
<p><b>Source:</b> Ohm's law.</p>
<p><b>Limitations:</b> no limit of current or voltage.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.PiezoStack\">Examples.PiezoStack</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Plants.PiezoStack\">Plants.PiezoStack</a>.</p>
</html>"));
end VoltageDrive;
