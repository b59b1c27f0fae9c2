within HystFMU.Functions;
function triangleWave "Triangle and its derivatives"
  extends Icons.Function;
  input Real t "Time";
  input Real frequency "Frequency";
  input Real phase "Phase";
  output Real w[3] "Value, first and second derivative";
protected
  Real q "Part of a cycle";
algorithm
  q := frequency*t + phase/6.283185307179586;
  q := q - floor(q);
  w[1] := if q < 0.25 then 4*q elseif q < 0.75 then 2 - 4*q else 4*q - 4;
  w[2] := if q >= 0.25 and q < 0.75 then -4*frequency else 4*frequency;
  w[3] := 0;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> rises through 0 at the start of a cycle, as the sine does.</p>
<p><b>Source:</b> definition.</p>
<p><b>Limitations:</b> the derivatives in the corners are those of the next piece.</p>
<p><b>Example:</b> <code>triangleWave(time, frequency, phase)</code> in <a href=\"modelica://HystFMU.Sources.Triangle\">Sources.Triangle</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.Triangle\">Sources.Triangle</a>, which uses it.</p>
</html>"));
end triangleWave;
