within HystFMU.Functions;
function zhaoTanInverseReconstructed "Branch of the reconstructed inverse Zhao-Tan operator"
  extends Icons.Function;
  input Real h "Wanted output of the operator";
  input Real origin[3] "Start and scale of the branch, from branchOrigin";
  output Real x "Output";
protected
  Real d = origin[3]*abs(h - origin[1]) "Length of the branch";
algorithm
  x := origin[2] + (if h >= origin[1] then 1 else -1)*(d + d*exp(-d))/origin[3];
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> x = x_p + sgn(h - h_p) g(s d)/s, g(d) = (1 + e<sup>-d</sup>) d.</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, eq. 11 (lost; reconstructed).</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>zhaoTanInverseReconstructed(h, Functions.branchOrigin(extrema, 0, x0, 2))</code> in <a href=\"modelica://HystFMU.Inverse.Events.ZhaoTanInverseReconstructed\">Inverse.Events.ZhaoTanInverseReconstructed</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Events.ZhaoTanInverseReconstructed\">Inverse.Events.ZhaoTanInverseReconstructed</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.ZhaoTanInverseReconstructed\">Inverse.Sampled.ZhaoTanInverseReconstructed</a>, which use it.</p>
</html>"));
end zhaoTanInverseReconstructed;
