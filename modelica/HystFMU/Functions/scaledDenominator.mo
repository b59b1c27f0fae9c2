within HystFMU.Functions;
function scaledDenominator "Monic denominator in scaled time"
  extends Icons.Function;
  input Real a[:] "Denominator, highest power of s first";
  input Real sigma "Time scale";
  output Real alpha[size(a, 1) - 1] "Coefficients of s/sigma, lowest power first, without the leading 1";
protected
  Integer na = size(a, 1) - 1;
algorithm
  for i in 1:size(a, 1) - 1 loop
    alpha[i] := a[na + 2 - i]/a[1]/sigma^(na + 1 - i);
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> alpha_i = a_(na + 2 - i)/a_1/sigma<sup>na + 1 - i</sup>.</p>
<p><b>Source:</b> substitution s = sigma p.</p>
<p><b>Limitations:</b> a[1] is not 0.</p>
<p><b>Example:</b> <code>scaledDenominator(a, sigma)</code> in <a href=\"modelica://HystFMU.Dynamics.TransferFunction\">Dynamics.TransferFunction</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.TransferFunction\">Dynamics.TransferFunction</a>, which uses it.</p>
</html>"));
end scaledDenominator;
