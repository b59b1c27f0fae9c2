within HystFMU.Functions;
function prandtlIshlinskiiInverse "Branch of the inverse Prandtl-Ishlinskii operator"
  extends Icons.Function;
  input Real y "Wanted output of the operator";
  input Real origin[3] "Start and scale of the branch, from branchOrigin";
  input Real w0 "Weight of the linear term, greater than 0";
  input Real r[:] "Thresholds, increasing";
  input Real w[size(r, 1)] "Weights";
  output Real u "Input of the operator";
protected
  Real g = 2*loadingCurveInverse(0.5*origin[3]*abs(y - origin[1]), w0, r, w);
algorithm
  u := origin[2] + (if y >= origin[1] then 1 else -1)*g/origin[3];
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> u = u_p + sgn(y - y_p) g(s d)/s, g(d) = 2 phi<sup>-1</sup>(d/2), phi the loading curve.</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 12-14.</p>
<p><b>Limitation:</b> w0 &gt; 0: without a linear term no continuous inverse exists.</p>
<p><b>Example:</b> <code>prandtlIshlinskiiInverse(y, Functions.branchOrigin(extrema, y0, u0, 2), w0, r, w)</code> in <a href=\"modelica://HystFMU.Inverse.Events.PrandtlIshlinskiiInverse\">Inverse.Events.PrandtlIshlinskiiInverse</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Events.PrandtlIshlinskiiInverse\">Inverse.Events.PrandtlIshlinskiiInverse</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.PrandtlIshlinskiiInverse\">Inverse.Sampled.PrandtlIshlinskiiInverse</a>, which use it.</p>
</html>"));
end prandtlIshlinskiiInverse;
