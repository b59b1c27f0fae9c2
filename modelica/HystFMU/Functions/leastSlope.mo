within HystFMU.Functions;
function leastSlope "Least slope of a loading curve"
  extends Icons.Function;
  input Real w0 "Weight of the linear term";
  input Real w[:] "Weights of the plays";
  output Real slope "Minimum of w0, w0 + w_1, ...";
protected
  Real sum_w;
algorithm
  sum_w := w0;
  slope := w0;
  for i in 1:size(w, 1) loop
    sum_w := sum_w + w[i];
    slope := min(slope, sum_w);
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> min over j of w0 + w_1 + ... + w_j.</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 12: the inverse exists if it is greater than 0.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>leastSlope(w0, w)</code> in <a href=\"modelica://HystFMU.Inverse.Events.PrandtlIshlinskiiInverse\">Inverse.Events.PrandtlIshlinskiiInverse</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Events.PrandtlIshlinskiiInverse\">Inverse.Events.PrandtlIshlinskiiInverse</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.PrandtlIshlinskiiInverse\">Inverse.Sampled.PrandtlIshlinskiiInverse</a>, which use it.</p>
</html>"));
end leastSlope;
