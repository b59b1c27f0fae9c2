within HystFMU.Actuators;
package Hysteresis "Identified hysteresis of actuators"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>The input is the voltage (V) that determines the polarisation, the output is the free stroke (m). Each class also computes the rate of the stroke and the power that the memory loses. Therefore an actuator does not differentiate signals.</p>
</html>"));
end Hysteresis;
