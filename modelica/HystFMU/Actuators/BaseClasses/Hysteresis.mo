within HystFMU.Actuators.BaseClasses;
partial model Hysteresis "Identified hysteresis of an actuator: ports, scaling, energies"
  extends Icons.Hysteresis;
  parameter Real gain(unit = "1/V", min = 0) = 0.01 "Scaled voltage per volt, greater than 0" annotation (Dialog(group = "Scaling"));
  parameter Real shift = 0 "Scaled voltage at 0 V" annotation (Dialog(group = "Scaling"));
  parameter Types.Position scale = 20e-6 "Stroke per scaled output" annotation (Dialog(group = "Scaling"));
  parameter Types.Position offset = 0 "Stroke at scaled output 0" annotation (Dialog(group = "Scaling"));
  parameter Types.Voltage u_start = 0 "Initial voltage, at which the memory rests" annotation (Dialog(group = "Start"));
  parameter Types.Position y_start = offset "Initial free stroke" annotation (Dialog(group = "Start"));
  parameter Boolean passive = false "True if it is proven that no closed cycle generates energy" annotation (Dialog(tab = "Advanced"));
  parameter Boolean instantaneous = false "True if heat >= 0 at every instant, not only over closed cycles" annotation (Dialog(tab = "Advanced"));
  Interfaces.RealInput u(unit = "V") "Voltage that determines the polarisation" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput temperature(unit = "K", displayUnit = "degC") "Temperature of the actuator" annotation (Placement(transformation(extent = {{-120, 60}, {-100, 80}})));
  Interfaces.RealInput du(unit = "V/s") "Rate of u" annotation (Placement(transformation(extent = {{-120, -80}, {-100, -60}})));
  Interfaces.RealOutput y(unit = "m") "Free stroke" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  Interfaces.RealOutput dy(unit = "m/s") "Rate of y" annotation (Placement(transformation(extent = {{100, -80}, {120, -60}})));
  Types.Position y_rest(nominal = 1e-5) "Free stroke with the memory at rest, at the current temperature";
  Real stored(unit = "V.m") "Energy in the memory, multiplied by the stroke per charge";
  Real heat(unit = "V.m/s") "Power lost by the memory, multiplied by the stroke per charge";
protected
  parameter Real x_start = gain*u_start + shift "Initial scaled voltage";
  Real x "Scaled voltage";
  Real dx(unit = "1/s") "Rate of x";
  Real s "Scaled output";
  Real ds(unit = "1/s") "Rate of s";
  Real kept "Scaled energy in the memory";
  Real lost(unit = "1/s") "Scaled power lost by the memory";
equation
  x = gain*u + shift;
  dx = gain*du;
  y = scale*s + offset;
  dy = scale*ds;
  stored = scale/gain*(kept - shift*s);
  heat = scale/gain*lost;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = scale H[gain u + shift] + offset and u y' = stored' + heat. If the stored energy is not known, kept = shift s and stored = 0. Then heat is the whole power, and only its mean over a closed cycle is a loss.</p>
<p><b>Heat:</b> heat &ge; 0 at every instant if <code>instantaneous</code> is true. The mean of heat over each closed cycle is &ge; 0 if <code>passive</code> is true. Otherwise the sign of heat is not known.</p>
<p><b>Source:</b> first law.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
</html>"));
end Hysteresis;
