within HystFMU.Operators.Smooth;
block JilesAtherton "Jiles-Atherton operator, smooth"
  extends BaseClasses.JilesAtherton(final usesRate = true);
  extends Interfaces.Rated;
protected
  Real h = (u + alpha*y)/a "Effective field in units of a";
  Real beyond = Ms*Functions.langevin(h) - y "Anhysteretic curve minus magnetisation";
  Real slope = noEvent(c*Ms/a*Functions.langevinSlope(h) + max(if rate > 0 then beyond else -beyond, 0)/k) "dy/dh";
initial equation
  y = Functions.jilesAthertonOutput(u, Functions.jilesAtherton(u, u0, m0, Ms, a, k, c, alpha, steps), Ms, a, c, alpha);
equation
  connect(du, rate) annotation (Line(points = {{-110, -70}, {-80, -70}}, color = {0, 0, 127}));
  assert(alpha*Ms < 3*a, "alpha Ms must be less than 3 a, otherwise the anhysteretic curve jumps");
  der(y) = slope/(1 - alpha*slope)*rate;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> the parameter steps is used only from u0 to the first input.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.JilesAtherton\">Operators.BaseClasses.JilesAtherton</a>: equation, source, example.</p>
</html>"));
end JilesAtherton;
