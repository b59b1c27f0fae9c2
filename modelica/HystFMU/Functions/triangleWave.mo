within HystFMU.Functions;
function triangleWave "Triangle and its derivatives"
  extends Icons.Function;
  input Real t "Time";
  input Real frequency "Frequency";
  input Real phase "Phase";
  input Real turn "Share of the period in the turn-arounds";
  output Real w[3] "Value, first and second derivative";
protected
  Real q "Fraction of a cycle";
  Real reach = turn/4 "Half the duration of a turn-around, as a fraction of a cycle";
  Real speed = 4/(1 - turn/2) "Speed of the lines per cycle";
  Real side "1 in the half cycle around the maximum, else -1";
  Real from "Fraction of a cycle since the extremum of this half cycle";
algorithm
  q := frequency*t + phase/6.283185307179586;
  q := q - floor(q);
  side := if q < 0.5 then 1 else -1;
  from := if q < 0.5 then q - 0.25 else q - 0.75;
  if abs(from) < reach then
    w[3] := -side*speed/reach;
    w[1] := side + w[3]*from^2/2;
    w[2] := w[3]*from*frequency;
    w[3] := w[3]*frequency^2;
  else
    w[1] := speed*(if q < 0.25 then q elseif q < 0.75 then 0.5 - q else q - 1);
    w[2] := if q >= 0.25 and q < 0.75 then -speed*frequency else speed*frequency;
    w[3] := 0;
  end if;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> the signal rises through 0 at the start of a cycle, like a sine. Parabolas around the extrema connect the lines; they take the share <em>turn</em> of the time.</p>
<p><b>Source:</b> definition.</p>
<p><b>Smoothness:</b> the second derivative jumps where a line begins.</p>
<p><b>Limitations:</b> at corners, the derivatives are those of the next piece.</p>
<p><b>Example:</b> <code>triangleWave(time, frequency, phase, turn)</code> in <a href=\"modelica://HystFMU.Sources.Triangle\">Sources.Triangle</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.Triangle\">Sources.Triangle</a>, which uses it.</p>
</html>"));
end triangleWave;
