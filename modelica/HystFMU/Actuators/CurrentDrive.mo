within HystFMU.Actuators;
model CurrentDrive "Current amplifier with a limit of voltage"
  extends Icons.Component;
  parameter Real gain(unit = "A") = 4 "Current per command" annotation (Dialog(group = "Parameters"));
  parameter Types.Voltage v_max(min = 0) = 100 "Highest voltage" annotation (Dialog(group = "Limits"));
  parameter Types.Resistance K(min = 0) = 100 "Gain of the current controller, greater than 0; the bandwidth is K/inductance" annotation (Dialog(tab = "Advanced"));
  parameter Types.Time T_i(min = 0) = 1e-3 "Integration time of the current controller, greater than 0" annotation (Dialog(tab = "Advanced"));
  Interfaces.RealInput u "Command" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.Pin pin_p "Output" annotation (Placement(transformation(extent = {{100, 40}, {120, 60}})));
  Interfaces.Pin pin_n "Return pin; the circuit needs one ground" annotation (Placement(transformation(extent = {{100, -60}, {120, -40}})));
protected
  Types.Voltage wanted "Voltage before the limit";
  Types.Voltage z(start = 0, fixed = true) "Integral part of the controller";
equation
  pin_p.i + pin_n.i = 0;
  wanted = K*(gain*u + pin_p.i) + z;
  pin_p.v - pin_n.v = min(max(wanted, -v_max), v_max);
  T_i*der(z) = pin_p.v - pin_n.v - z;
  annotation (
    Icon(graphics = {Text(extent = {{-70, -40}, {70, 40}}, textString = "A")}),
    Documentation(info = "<html>
<p><b>Equation:</b> v = sat(K (gain u - i) + z), T_i z' = v - z, with the delivered current i and the voltage v. This is PI control without windup.</p>
<p><b>Source:</b> Astrom &amp; Hagglund, PID Controllers, 2nd ed. 1995, section 3.5: integration by a lag of the limited output.</p>
<p><b>Limitations:</b> only for inductive loads; no current limit; no internal ground.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MagnetostrictiveRod\">Examples.MagnetostrictiveRod</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.VoltageDrive\">Actuators.VoltageDrive</a>, <a href=\"modelica://HystFMU.Actuators.MagnetostrictiveRod\">Actuators.MagnetostrictiveRod</a>.</p>
</html>"));
end CurrentDrive;
