within HystFMU.Actuators;
model ChargeDrive "Charge amplifier with a limit of current"
  extends Icons.Component;
  parameter Types.Charge gain = 6e-4 "Charge per command" annotation (Dialog(group = "Parameters"));
  parameter Types.Current i_max(min = 0) = 0.2 "Highest current" annotation (Dialog(group = "Limits"));
  parameter Types.Resistance leak(min = 0) = 1e9 "Leakage resistance in parallel to the load, greater than 0" annotation (Dialog(tab = "Advanced"));
  parameter Types.Time T(min = 0) = 2e-5 "Time constant of the charge, greater than 0" annotation (Dialog(tab = "Advanced"));
  parameter Types.Charge q_start = 0 "Initial charge" annotation (Dialog(group = "Start"));
  Interfaces.RealInput u "Command" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.Pin pin_p "Output" annotation (Placement(transformation(extent = {{100, 40}, {120, 60}})));
  Interfaces.Pin pin_n "Return pin; the circuit needs one ground" annotation (Placement(transformation(extent = {{100, -60}, {120, -40}})));
  Types.Charge q(start = q_start, fixed = true, nominal = 1e-4) "Charge delivered by the drive";
equation
  der(q) = min(max((gain*u - q)/T, -i_max), i_max);
  pin_p.i = (pin_p.v - pin_n.v)/leak - der(q);
  pin_n.i = -pin_p.i;
  annotation (
    Icon(graphics = {Text(extent = {{-70, -40}, {70, 40}}, textString = "Q")}),
    Documentation(info = "<html>
<p><b>Equation:</b> q' = sat((gain u - q)/T), i = q' - v/leak.</p>
<p><b>Source:</b> Comstock, US patent 4263527, 1981; Fleming &amp; Leang 2014, chapter 11.</p>
<p><b>Limitations:</b> no voltage limit; the charge through the leakage resistance is not measured, so the load drifts with the time constant leak C.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.ChargeDrive\">Examples.ChargeDrive</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.VoltageDrive\">Actuators.VoltageDrive</a>.</p>
</html>"));
end ChargeDrive;
