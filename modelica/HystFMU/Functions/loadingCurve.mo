within HystFMU.Functions;
function loadingCurve "Initial loading curve of a sum of plays"
  extends Icons.Function;
  input Real q "Input, at least 0";
  input Real w0 "Weight of the linear term";
  input Real r[:] "Thresholds, increasing";
  input Real w[size(r, 1)] "Weights";
  output Real phi "Output";
algorithm
  phi := w0*q;
  for i in 1:size(r, 1) loop
    phi := phi + w[i]*max(q - r[i], 0);
  end for;
  annotation (smoothOrder = 0, inverse(q = loadingCurveInverse(phi, w0, r, w)), Documentation(info = "<html>
<p><b>Equation:</b> phi(q) = w0 q + sum_i w_i max(q - r_i, 0).</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 10.</p>
<p><b>Limitation:</b> q &ge; 0.</p>
<p><b>Example:</b> <code>loadingCurve(0.5*origin[3]*abs(u - origin[1]), w0, r, w)</code> in <a href=\"modelica://HystFMU.Functions.prandtlIshlinskii\">Functions.prandtlIshlinskii</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.prandtlIshlinskii\">Functions.prandtlIshlinskii</a>, which uses it.</p>
</html>"));
end loadingCurve;
