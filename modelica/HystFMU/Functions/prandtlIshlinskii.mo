within HystFMU.Functions;
function prandtlIshlinskii "Branch of the Prandtl-Ishlinskii operator"
  extends Icons.Function;
  input Real u "Input";
  input Real origin[3] "Start and scale of the branch, from branchOrigin";
  input Real w0 "Weight of the linear term";
  input Real r[:] "Thresholds, increasing";
  input Real w[size(r, 1)] "Weights";
  output Real y "Operator output";
protected
  Real g = 2*loadingCurve(0.5*origin[3]*abs(u - origin[1]), w0, r, w);
algorithm
  y := origin[2] + (if u >= origin[1] then 1 else -1)*g/origin[3];
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> y = y_p + sgn(u - u_p) g(s d)/s, g(d) = 2 phi(d/2), phi the loading curve.</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 5-10.</p>
<p><b>Limitation:</b> all plays must start from the same input value.</p>
<p><b>Example:</b> <code>prandtlIshlinskii(u, Functions.branchOrigin(memory, u0, (w0 + sum(w))*u0, 2), w0, r, w)</code> in <a href=\"modelica://HystFMU.Operators.Sampled.PrandtlIshlinskii\">Operators.Sampled.PrandtlIshlinskii</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.PrandtlIshlinskii\">Operators.Sampled.PrandtlIshlinskii</a>, which uses it.</p>
</html>"));
end prandtlIshlinskii;
