within HystFMU.Functions;
function bendLeastSlope "Least slope of a sum of dead zones"
  extends Icons.Function;
  input Real w0 "Slope at 0";
  input Real r[:] "Thresholds; the sign selects the side";
  input Real w[size(r, 1)] "Weights of the dead zones";
  output Real least "Least slope";
protected
  Real slope "Slope beyond the current threshold";
algorithm
  least := w0;
  for i in 1:size(r, 1) loop
    slope := w0;
    for j in 1:size(r, 1) loop
      slope := slope + (if r[i]*r[j] > 0 and abs(r[j]) <= abs(r[i]) or abs(r[j]) <= 0 then w[j] else 0);
    end for;
    least := min(least, slope);
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> the smallest of the slopes at 0 and beyond each threshold.</p>
<p><b>Source:</b> derivative of Operators.DeadZones.</p>
<p><b>Limitations:</b> a dead zone with threshold 0 does not contribute to the slope at 0.</p>
<p><b>Example:</b> <code>bendLeastSlope(b0, knots, b)</code> in <a href=\"modelica://HystFMU.Actuators.BaseClasses.Bent\">Actuators.BaseClasses.Bent</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.Hysteresis.BentPrandtlIshlinskii\">Actuators.Hysteresis.BentPrandtlIshlinskii</a>, which uses it.</p>
</html>"));
end bendLeastSlope;
