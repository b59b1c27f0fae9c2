within HystFMU.Functions;
function lag "First-order lags after a step with a held input"
  extends Icons.Function;
  input Real u "Input, held over the step";
  input Real T[:] "Time constants";
  input Real dt "Step";
  input Real q[size(T, 1)] "Last lags";
  output Real q_new[size(T, 1)] "New lags";
algorithm
  for i in 1:size(T, 1) loop
    q_new[i] := q[i] + (1 - exp(-dt/T[i]))*(u - q[i]);
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> q+ = q + (1 - e<sup>-dt/T</sup>) (u - q).</p>
<p><b>Source:</b> exact discretisation with a held input.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>lag(u, T, Ts, pre(q))</code> in <a href=\"modelica://HystFMU.Operators.Sampled.Creep\">Operators.Sampled.Creep</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.Creep\">Operators.Sampled.Creep</a>, which uses it.</p>
</html>"));
end lag;
