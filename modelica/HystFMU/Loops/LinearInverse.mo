within HystFMU.Loops;
block LinearInverse "Inverse of a plant that is approximated by a gain"
  extends Interfaces.Inverse;
  parameter Real gain = 1 "Gain of the plant, not 0" annotation (Dialog(group = "Parameters"));
  parameter Types.Time Ts = 1e-4 "Sample period of the loop; has no effect" annotation (Dialog(group = "Sampling"));
equation
  u = y/gain;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> u = y/gain.</p>
<p><b>Source:</b> a plant without hysteresis.</p>
<p><b>Limitations:</b> the controller must correct the hysteresis.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.Duhem\">Examples.Duhem</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Loops.IdentifiedInverse\">Loops.IdentifiedInverse</a>.</p>
</html>"));
end LinearInverse;
