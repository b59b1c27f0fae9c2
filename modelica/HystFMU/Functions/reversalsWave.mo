within HystFMU.Functions;
function reversalsWave "Half cosines between levels"
  extends Icons.Function;
  input Real t "Time";
  input Real levels[:] "Levels";
  input Real frequency "Frequency; a piece lasts half a period";
  output Real w[3] "Value, first and second derivative";
protected
  Real place = 2*frequency*t "Number of pieces since the start";
  Integer k = integer(floor(min(max(2*frequency*t, 0), size(levels, 1) - 1.5))) "Piece";
  Real angle;
  Real half;
  Real omega = 6.283185307179586*frequency;
algorithm
  angle := 3.141592653589793*(place - k);
  half := 0.5*(levels[k + 2] - levels[k + 1]);
  w[1] := if place < 0 then levels[1] elseif place >= size(levels, 1) - 1 then levels[size(levels, 1)] else levels[k + 1] + half*(1 - cos(angle));
  w[2] := if place < 0 or place >= size(levels, 1) - 1 then 0 else half*omega*sin(angle);
  w[3] := if place < 0 or place >= size(levels, 1) - 1 then 0 else half*omega*omega*cos(angle);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> l_k + (l_(k+1) - l_k) (1 - cos(pi p))/2.</p>
<p><b>Source:</b> definition.</p>
<p><b>Smoothness:</b> the second derivative jumps at an extremum.</p>
<p><b>Limitations:</b> the signal is constant before the start and after the last level.</p>
<p><b>Example:</b> <code>reversalsWave(time, levels, frequency)</code> in <a href=\"modelica://HystFMU.Sources.RandomReversals\">Sources.RandomReversals</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.RandomReversals\">Sources.RandomReversals</a>, which uses it.</p>
</html>"));
end reversalsWave;
