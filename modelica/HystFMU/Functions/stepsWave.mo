within HystFMU.Functions;
function stepsWave "Sequence of levels"
  extends Icons.Function;
  input Real t "Time";
  input Real levels[:] "Levels; the last level stays";
  input Real T "Duration of a level";
  output Real w[3] "Value, first and second derivative";
algorithm
  w := zeros(3);
  w[1] := levels[1];
  for i in 2:size(levels, 1) loop
    w[1] := if t/T*(1 + 1e-9) >= i - 1 then levels[i] else w[1];
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> level i for (i - 1) T &le; t &lt; i T.</p>
<p><b>Source:</b> definition.</p>
<p><b>Smoothness:</b> the signal jumps from level to level.</p>
<p><b>Limitations:</b> the derivatives are always 0, also at jumps.</p>
<p><b>Example:</b> <code>stepsWave(time, levels, T)</code> in <a href=\"modelica://HystFMU.Sources.Steps\">Sources.Steps</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.Steps\">Sources.Steps</a>, which uses it.</p>
</html>"));
end stepsWave;
