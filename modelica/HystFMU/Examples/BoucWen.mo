within HystFMU.Examples;
model BoucWen "PID around a Bouc-Wen actuator, with the inverse of plays that were identified from it"
  extends Loops.Tracking(
    redeclare Control.Pid controller(Kp = 0.4761, Ki = 4446, Kd = 0.0003252, tau = 7.305e-06, Ts = Ts),
    redeclare Loops.IdentifiedInverse inverse(n = identified.hysteresis_n, w0 = identified.hysteresis_w0, r = identified.hysteresis_r, w = identified.hysteresis_w, u0 = identified.hysteresis_u0, gain = identified.readout_gain[1], offset = identified.readout_offset[1], Ts = Ts),
    redeclare Loops.BoucWenPlant plant(Ts = Ts));
  parameter Data.BoucWenIdentified identified "Plays as identified" annotation (Dialog(group = "Parameters"), Placement(transformation(extent = {{-40, 40}, {-20, 60}})));
  annotation (experiment(StopTime = 0.2, Interval = 1e-4, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>The plays are 2.2 % off, since the plant is of another class; the controller takes off what they leave. All three slots of the loop are filled.</p>
<p><b>Source:</b> the case other_class_10 of the scenario pid; Yu &amp; Alici 2005.</p>
<p><b>Limitations:</b> a sine of 10 Hz: no disturbance, no noise.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Loops.BoucWenPlant\">Loops.BoucWenPlant</a>, <a href=\"modelica://HystFMU.Loops.IdentifiedInverse\">Loops.IdentifiedInverse</a>, <a href=\"modelica://HystFMU.Loops.Tracking\">Loops.Tracking</a>.</p>
</html>"));
end BoucWen;
