within HystFMU.Actuators.BaseClasses;
partial model Hysteresis "Identified static model in the slot of an actuator: ports, scaling, energies"
  extends Icons.Hysteresis;
  parameter Real gain(unit = "1/V", min = 0) = 0.01 "Scaled voltage of 1 V, greater than 0" annotation (Dialog(group = "Scaling"));
  parameter Real shift = 0 "Scaled voltage at 0 V" annotation (Dialog(group = "Scaling"));
  parameter Types.Position scale = 20e-6 "Stroke where the scaled output is 1" annotation (Dialog(group = "Scaling"));
  parameter Types.Position offset = 0 "Stroke where the scaled output is 0" annotation (Dialog(group = "Scaling"));
  parameter Types.Voltage u_start = 0 "Voltage at which the memory rests at the start" annotation (Dialog(group = "Start"));
  parameter Types.Position y_start = offset "Free stroke at the start" annotation (Dialog(group = "Start"));
  parameter Boolean passive = false "Is it shown that a closed cycle gives no energy back?" annotation (Dialog(tab = "Advanced"));
  parameter Boolean instantaneous = false "Is heat at least 0 at every instant? false: over closed cycles only, if passive" annotation (Dialog(tab = "Advanced"));
  Interfaces.RealInput u(unit = "V") "Voltage that the polarisation follows" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput temperature(unit = "K", displayUnit = "degC") "Temperature of the actuator" annotation (Placement(transformation(extent = {{-120, 60}, {-100, 80}})));
  Interfaces.RealInput du(unit = "V/s") "Rate of u" annotation (Placement(transformation(extent = {{-120, -80}, {-100, -60}})));
  Interfaces.RealOutput y(unit = "m") "Free stroke" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  Interfaces.RealOutput dy(unit = "m/s") "Rate of y" annotation (Placement(transformation(extent = {{100, -80}, {120, -60}})));
  Types.Position y_rest(nominal = 1e-5) "Free stroke of the memory at rest, at this temperature";
  Real stored(unit = "V.m") "Energy in the memory, times the stroke of a charge";
  Real heat(unit = "V.m/s") "Power that the memory loses, times the stroke of a charge";
protected
  parameter Real x_start = gain*u_start + shift "Scaled voltage at the start";
  Real x "Scaled voltage";
  Real dx(unit = "1/s") "Its rate";
  Real s "Scaled output";
  Real ds(unit = "1/s") "Its rate";
  Real kept "Scaled energy in the memory";
  Real lost(unit = "1/s") "Scaled power that the memory loses";
equation
  x = gain*u + shift;
  dx = gain*du;
  y = scale*s + offset;
  dy = scale*ds;
  stored = scale/gain*(kept - shift*s);
  heat = scale/gain*lost;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = scale H[gain u + shift] + offset and u y' = stored' + heat. A class whose stored energy is not known has kept = shift s, stored = 0: its heat is the whole power, and only the mean over a closed cycle is a loss.</p>
<p><b>Heat:</b> at least 0 at every instant if <code>instantaneous</code>; at least 0 over every closed cycle, and of either sign within it, if <code>passive</code>; else its sign is not shown.</p>
<p><b>Source:</b> first law.</p>
<p><b>Limitations:</b> those of the classes that extend it.</p>
</html>"));
end Hysteresis;
