within HystFMU.Functions;
function langevinSlope "Slope of the Langevin function"
  extends Icons.Function;
  input Real x "Argument";
  output Real slope "dL/dx";
protected
  Real size = max(abs(x), 1) "Argument of the formula that loses digits near 0";
  Real e = exp(-2*size);
  Real p;
algorithm
  if abs(x) < 1 then
    p := langevinRatio(x*x);
    slope := 1 - 2*p - x*x*p*p;
  else
    slope := 1/size/size - 4*e/((1 - e)*(1 - e));
  end if;
  annotation (smoothOrder = 2, Documentation(info = "<html>
<p><b>Equation:</b> dL/dx = 1/x<sup>2</sup> - 1/sinh<sup>2</sup> x = 1 - 2 L/x - L<sup>2</sup>, 1/3 at 0.</p>
<p><b>Source:</b> Langevin 1905.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>langevinSlope(h/a)</code> in <a href=\"modelica://HystFMU.Functions.jilesAthertonField\">Functions.jilesAthertonField</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Smooth.JilesAtherton\">Operators.Smooth.JilesAtherton</a>, <a href=\"modelica://HystFMU.Functions.jilesAthertonDistance\">Functions.jilesAthertonDistance</a>, which use it.</p>
</html>"));
end langevinSlope;
