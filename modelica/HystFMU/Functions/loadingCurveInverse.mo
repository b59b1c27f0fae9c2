within HystFMU.Functions;
function loadingCurveInverse "Inverse of the initial loading curve of a sum of plays"
  extends Icons.Function;
  input Real v "Output of the loading curve, at least 0";
  input Real w0 "Weight of the linear term, greater than 0";
  input Real r[:] "Thresholds, increasing";
  input Real w[size(r, 1)] "Weights";
  output Real q "Input of the loading curve";
protected
  Real slope "Slope of the curve above the previous thresholds";
  Real offset "Offset in phi = slope q - offset";
  Real slope_v "Slope of the piece that contains v";
  Real offset_v;
algorithm
  slope := w0;
  offset := 0;
  slope_v := w0;
  offset_v := 0;
  for i in 1:size(r, 1) loop
    // the curve at threshold i is below v, so v is in a later piece
    if v > slope*r[i] - offset then
      slope_v := slope + w[i];
      offset_v := offset + w[i]*r[i];
    end if;
    slope := slope + w[i];
    offset := offset + w[i]*r[i];
  end for;
  q := (v + offset_v)/slope_v;
  annotation (smoothOrder = 0, inverse(v = loadingCurve(q, w0, r, w)), Documentation(info = "<html>
<p><b>Equation:</b> q = (v + R_j)/W_j, W_j = w0 + w_1 + ... + w_j, R_j = w_1 r_1 + ... + w_j r_j, with j the number of
thresholds at which the curve is below v.</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 12-14.</p>
<p><b>Limitation:</b> w0 and every W_j must be greater than 0.</p>
<p><b>Example:</b> <code>loadingCurveInverse(0.5*origin[3]*abs(y - origin[1]), w0, r, w)</code> in <a href=\"modelica://HystFMU.Functions.prandtlIshlinskiiInverse\">Functions.prandtlIshlinskiiInverse</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.prandtlIshlinskiiInverse\">Functions.prandtlIshlinskiiInverse</a>, which uses it.</p>
</html>"));
end loadingCurveInverse;
