within HystFMU.Functions;
function langevinRatio "Langevin function divided by its argument, near 0"
  extends Icons.Function;
  input Real q "Square of the argument, at most 1";
  output Real p "L(x)/x for x^2 = q";
algorithm
  p := 1/(3 + q/(5 + q/(7 + q/(9 + q/(11 + q/(13 + q/(15 + q/17)))))));
  annotation (smoothOrder = 2, Documentation(info = "<html>
<p><b>Equation:</b> L(x)/x = 1/(3 + x<sup>2</sup>/(5 + x<sup>2</sup>/(7 + ...))).</p>
<p><b>Source:</b> Lambert's continued fraction of tanh.</p>
<p><b>Limitations:</b> q &le; 1 for full accuracy.</p>
<p><b>Example:</b> <code>langevinRatio(x*x)</code> in <a href=\"modelica://HystFMU.Functions.langevin\">Functions.langevin</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.langevin\">Functions.langevin</a>, <a href=\"modelica://HystFMU.Functions.langevinSlope\">Functions.langevinSlope</a>, which use it.</p>
</html>"));
end langevinRatio;
