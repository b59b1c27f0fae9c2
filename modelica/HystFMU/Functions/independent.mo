within HystFMU.Functions;
function independent "Covariance matrix of independent values: rows up to the diagonal"
  extends Icons.Function;
  input Real sd[:] "Standard deviations";
  output Real P[div(size(sd, 1)*(size(sd, 1) + 1), 2)] "Rows of the covariance up to the diagonal";
algorithm
  P := zeros(div(size(sd, 1)*(size(sd, 1) + 1), 2));
  for i in 1:size(sd, 1) loop
    P[div(i*(i + 1), 2)] := sd[i]*sd[i];
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> P_ii = sd_i^2, all others 0.</p>
<p><b>Source:</b> definition.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>independent(start*sd)</code> in <a href=\"modelica://HystFMU.Inverse.AdaptiveInverse\">Inverse.AdaptiveInverse</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.AdaptiveInverse\">Inverse.AdaptiveInverse</a>, <a href=\"modelica://HystFMU.Functions.adaptWeights\">Functions.adaptWeights</a>, which use it.</p>
</html>"));
end independent;
