within HystFMU.Functions;
function zhaoTan "Branch of the Zhao-Tan operator"
  extends Icons.Function;
  input Real x "Input";
  input Real origin[3] "Start and scale of the branch, from branchOrigin";
  output Real h "Operator output";
protected
  Real d = origin[3]*abs(x - origin[1]);
algorithm
  h := origin[2] + (if x >= origin[1] then 1 else -1)*(1 + exp(-d))*tanh(0.5*d)*d/origin[3];
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> h = h_p + sgn(x - x_p) g(s d)/s, g(d) = (1 - e<sup>-d</sup>) d, d = abs(x - x_p).</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, eq. 4.</p>
<p><b>Limitation:</b> the branch is convex only for d &lt; 2; scale the input accordingly.</p>
<p><b>Example:</b> <code>zhaoTan(x, Functions.branchOrigin(extrema, x0, 0, virgin))</code> in <a href=\"modelica://HystFMU.Operators.Events.ZhaoTan\">Operators.Events.ZhaoTan</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Events.ZhaoTan\">Operators.Events.ZhaoTan</a>, <a href=\"modelica://HystFMU.Operators.Sampled.ZhaoTan\">Operators.Sampled.ZhaoTan</a>, which use it.</p>
</html>"));
end zhaoTan;
