within HystFMU.Dynamics;
block Amplifier "Piezo amplifier with limited voltage, current and bandwidth"
  extends BaseClasses.Amplifier;
  Types.Voltage voltage(start = 0, fixed = true) "Voltage at the actuator";
protected
  parameter Real omega(unit = "rad/s") = 6.283185307179586*f_b "Bandwidth";
  parameter Types.Voltage most = i_max/C/omega "Voltage error at the current limit";
  Types.Voltage wanted "Command within the limits of voltage";
  Types.Voltage driving "Error within the limit of current";
equation
  assert(u_min <= u_max, "u_min must not be greater than u_max");
  wanted = min(u_max, max(u_min, u));
  driving = min(most, max(-most, wanted - voltage));
  der(voltage) = omega*driving;
  y = voltage;
  excess = (u - wanted) + (wanted - voltage - driving);
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> the block is continuous; the solver determines its accuracy. The unit of the same name is exact if the command is held over a step.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.BaseClasses.Amplifier\">Dynamics.BaseClasses.Amplifier</a>: equation, source, example.</p>
</html>"));
end Amplifier;
