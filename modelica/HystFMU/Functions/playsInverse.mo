within HystFMU.Functions;
function playsInverse "Input at which the sum of a linear term and plays has the wanted output"
  extends Icons.Function;
  input Real v "Wanted output";
  input Real last "Last input";
  input Real z[:] "Plays at the last input";
  input Real r[size(z, 1)] "Half-widths, not decreasing";
  input Real theta[size(z, 1) + 1] "Weights of the input and of the plays";
  output Real u = last "Input with the wanted output";
protected
  Integer n = size(z, 1);
  Real left = v - theta[1]*last "Wanted output minus output";
  Real way "Direction of the input";
  Real go "Path of the input to the next play that begins to move";
  Real slope = theta[1] "Slope of the output";
  Real moving = 1 "1 while further plays begin to move";
algorithm
  for i in 1:n loop
    left := left - theta[i + 1]*z[i];
  end for;
  way := if left < 0 then -1 else 1;
  left := abs(left);
  for i in 1:n loop
    go := max(way*(z[i] + way*r[i] - u), 0);
    moving := if go*slope >= left then 0 else moving;
    left := left - moving*go*slope;
    u := u + moving*way*go;
    slope := slope + moving*theta[i + 1];
  end for;
  u := u + way*left/slope;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> theta_1 u + sum_i theta_(i+1) p_i[u] = v; the plays begin to move in the order of their half-widths.</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 3 and 10-14.</p>
<p><b>Limitations:</b> all plays must have the same past; theta_1 &gt; 0, and the other weights must not be negative.</p>
<p><b>Example:</b> <code>playsInverse(v, pre(u), pre(z), r, theta)</code> in <a href=\"modelica://HystFMU.Inverse.AdaptiveInverse\">Inverse.AdaptiveInverse</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.AdaptiveInverse\">Inverse.AdaptiveInverse</a>, which uses it.</p>
</html>"));
end playsInverse;
