within HystFMU.Functions;
function langevin "Langevin function"
  extends Icons.Function;
  input Real x "Argument";
  output Real L "coth x - 1/x";
protected
  Real size = max(abs(x), 1) "Argument of the formula that loses digits near 0";
  Real e = exp(-2*size);
algorithm
  if abs(x) < 1 then
    L := x*langevinRatio(x*x);
  else
    L := (if x > 0 then 1 else -1)*((1 + e)/(1 - e) - 1/size);
  end if;
  annotation (smoothOrder = 2, Documentation(info = "<html>
<p><b>Equation:</b> L(x) = coth x - 1/x, L(0) = 0.</p>
<p><b>Source:</b> Langevin 1905.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>langevin(h/a)</code> in <a href=\"modelica://HystFMU.Functions.jilesAthertonField\">Functions.jilesAthertonField</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.jilesAthertonField\">Functions.jilesAthertonField</a>, <a href=\"modelica://HystFMU.Functions.jilesAthertonRelease\">Functions.jilesAthertonRelease</a>, <a href=\"modelica://HystFMU.Functions.jilesAthertonStep\">Functions.jilesAthertonStep</a>, <a href=\"modelica://HystFMU.Functions.jilesAtherton\">Functions.jilesAtherton</a>, which use it.</p>
</html>"));
end langevin;
