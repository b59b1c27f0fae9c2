within HystFMU.Functions;
function bendSlope "Slope of a sum of dead zones"
  extends Icons.Function;
  input Real u "Input";
  input Real w0 "Slope at 0";
  input Real r[:] "Thresholds; the sign selects the side";
  input Real w[size(r, 1)] "Weights of the dead zones";
  output Real slope "Slope at u";
algorithm
  slope := w0;
  for i in 1:size(r, 1) loop
    slope := slope + (if r[i] > 0 and u > r[i] or r[i] < 0 and u < r[i] or abs(r[i]) <= 0 then w[i] else 0);
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> w0 plus the sum of all w_i for which u is outside the dead zone.</p>
<p><b>Smoothness:</b> the slope jumps at each threshold.</p>
<p><b>Source:</b> derivative of Operators.DeadZones.</p>
<p><b>Smoothness:</b> the slope jumps at a threshold.</p>
<p><b>Limitations:</b> at a threshold, the result is the slope inside the dead zone.</p>
<p><b>Example:</b> <code>bendSlope(p, b0, knots, b)</code> in <a href=\"modelica://HystFMU.Actuators.BaseClasses.Bent\">Actuators.BaseClasses.Bent</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.Hysteresis.BentPrandtlIshlinskii\">Actuators.Hysteresis.BentPrandtlIshlinskii</a>, which uses it.</p>
</html>"));
end bendSlope;
