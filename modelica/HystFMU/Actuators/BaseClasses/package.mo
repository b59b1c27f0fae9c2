within HystFMU.Actuators;
package BaseClasses "Base classes of actuators and their hysteresis"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Every hysteresis of an actuator extends BaseClasses.Hysteresis. Every actuator extends the electromechanical model BaseClasses.Piezo or BaseClasses.Magnetostrictive.</p>
</html>"));
end BaseClasses;
