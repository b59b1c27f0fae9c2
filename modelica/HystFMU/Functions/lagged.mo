within HystFMU.Functions;
function lagged "Part of a list of lags"
  extends Icons.Function;
  input Real past[:] "Values, newest first";
  input Integer first "Number of values to skip";
  input Integer n "Number of values to return";
  output Real z[n] "Values";
algorithm
  for i in 1:n loop
    z[i] := past[first + i];
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> z_i = past_(first + i).</p>
<p><b>Source:</b> definition.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>lagged(past_u, n_k, n_u)</code> in <a href=\"modelica://HystFMU.Networks.PolynomialNarx\">Networks.PolynomialNarx</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Networks.PolynomialNarx\">Networks.PolynomialNarx</a>, <a href=\"modelica://HystFMU.Inverse.AdaptiveInverse\">Inverse.AdaptiveInverse</a>, which use it.</p>
</html>"));
end lagged;
