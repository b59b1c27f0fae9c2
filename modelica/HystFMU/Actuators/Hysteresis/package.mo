within HystFMU.Actuators;
package Hysteresis "Identified static models for the slot of an actuator"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>From the voltage that the polarisation follows (V) to the free stroke (m), with the rate of the stroke and the power that the memory loses, so that an actuator differentiates nothing.</p>
</html>"));
end Hysteresis;
