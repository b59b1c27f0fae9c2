within HystFMU.Actuators;
package BaseClasses "What actuators and their hysteresis have in common"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>The one class that every hysteresis of an actuator extends, and the electromechanics that every actuator extends.</p>
</html>"));
end BaseClasses;
