within HystFMU.Actuators;
model VoltageDrive "Voltage amplifier with limits of voltage, slew rate and current"
  extends Icons.Component;
  parameter Real gain(unit = "V") = 100 "Voltage per command" annotation (Dialog(group = "Parameters"));
  parameter Types.Voltage v_min = -30 "Lowest voltage" annotation (Dialog(group = "Limits"));
  parameter Types.Voltage v_max = 130 "Highest voltage" annotation (Dialog(group = "Limits"));
  parameter Real slew(unit = "V/s", min = 0) = 1e6 "Highest rate of the voltage without load" annotation (Dialog(group = "Limits"));
  parameter Types.Current i_max(min = 0) = 0.2 "Highest current" annotation (Dialog(group = "Limits"));
  parameter Types.Resistance resistance(min = 0) = 10 "Output resistance, greater than 0" annotation (Dialog(group = "Parameters"));
  parameter Types.Time T_v(min = 0) = 2e-5 "Time constant of the voltage, greater than 0" annotation (Dialog(tab = "Advanced"));
  parameter Types.Time T_i(min = 0) = 5e-6 "Time constant of the current, greater than 0" annotation (Dialog(tab = "Advanced"));
  parameter Types.Voltage v_start = 0 "Initial voltage" annotation (Dialog(group = "Start"));
  Interfaces.RealInput u "Command" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.Pin pin_p "Output" annotation (Placement(transformation(extent = {{100, 40}, {120, 60}})));
  Interfaces.Pin pin_n "Return pin; the circuit needs one ground" annotation (Placement(transformation(extent = {{100, -60}, {120, -40}})));
  Types.Voltage v(start = v_start, fixed = true, nominal = 100) "Voltage without load";
  Types.Current i(start = 0, fixed = true) "Current delivered by the drive";
equation
  pin_p.i = -i;
  pin_n.i = i;
  der(v) = min(max((min(max(gain*u, v_min), v_max) - v)/T_v, -slew), slew);
  T_i*der(i) = min(max((v - (pin_p.v - pin_n.v))/resistance, -i_max), i_max) - i;
  annotation (
    Icon(graphics = {Text(extent = {{-70, -40}, {70, 40}}, textString = "V")}),
    Documentation(info = "<html>
<p><b>Equation:</b> v' = sat((sat(gain u) - v)/T_v), T_i i' = sat((v - v_pins)/R) - i.</p>
<p><b>Source:</b> limits of a piezo amplifier: Fleming &amp; Leang, Design, Modeling and Control of Nanopositioning Systems 2014, chapter 14.</p>
<p><b>Limitations:</b> the current is a state, so the load must not be an inductor alone; no internal ground.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.ChargeDrive\">Examples.ChargeDrive</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.ChargeDrive\">Actuators.ChargeDrive</a>.</p>
</html>"));
end VoltageDrive;
