within HystFMU.Functions;
function playWeights "Weights of plays on an equidistant grid for a given loading curve"
  extends Icons.Function;
  input Real phi[:] "Loading curve at 0, step, 2 step, ...";
  input Real step "Step of the grid";
  output Real w[size(phi, 1) - 1] "Weights of the plays with half-widths 0, step, 2 step, ...";
algorithm
  w[1] := (phi[2] - phi[1])/step;
  for i in 2:size(phi, 1) - 1 loop
    w[i] := (phi[i + 1] - 2*phi[i] + phi[i - 1])/step;
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> w_0 = (phi_1 - phi_0)/step, w_i = (phi_(i+1) - 2 phi_i + phi_(i-1))/step, which gives the polygon through the points.</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 10.</p>
<p><b>Limitations:</b> the loading curve is linear between the points.</p>
<p><b>Example:</b> <code>playWeights(Functions.zhaoTanLoading(q), 0.5*reach/plays)</code> in <a href=\"modelica://HystFMU.Operators.Smooth.ZhaoTan\">Operators.Smooth.ZhaoTan</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Smooth.ConstraintFactor\">Operators.Smooth.ConstraintFactor</a>, <a href=\"modelica://HystFMU.Operators.Smooth.ZhaoTan\">Operators.Smooth.ZhaoTan</a>, which use it.</p>
</html>"));
end playWeights;
