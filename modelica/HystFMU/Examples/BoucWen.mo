within HystFMU.Examples;
model BoucWen "PID control of a Bouc-Wen actuator with the inverse of identified plays"
  extends Loops.Tracking(
    redeclare Control.Pid controller(Kp = 0.4761, Ki = 4446, Kd = 0.0003252, tau = 7.305e-06, Ts = Ts),
    redeclare Loops.IdentifiedInverse inverse(n = identified.hysteresis_n, w0 = identified.hysteresis_w0, r = identified.hysteresis_r, w = identified.hysteresis_w, u0 = identified.hysteresis_u0, gain = identified.readout_gain[1], offset = identified.readout_offset[1], Ts = Ts),
    redeclare Loops.BoucWenPlant plant(Ts = Ts));
  parameter Data.BoucWenIdentified identified "Identified plays" annotation (Dialog(group = "Parameters"), Placement(transformation(extent = {{-40, 40}, {-20, 60}})));
  annotation (experiment(StopTime = 0.2, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>The error of the plays is 2.2 %, because the plant is not a sum of plays. The controller corrects this error. The example replaces plant, inverse and controller of the loop.</p>
<p><b>Source:</b> the case other_class_10 of the scenario pid; Yu &amp; Alici 2005.</p>
<p><b>Limitations:</b> a sine of 10 Hz without disturbance and noise.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Loops.BoucWenPlant\">Loops.BoucWenPlant</a>, <a href=\"modelica://HystFMU.Loops.IdentifiedInverse\">Loops.IdentifiedInverse</a>, <a href=\"modelica://HystFMU.Loops.Tracking\">Loops.Tracking</a>.</p>
</html>"));
end BoucWen;
