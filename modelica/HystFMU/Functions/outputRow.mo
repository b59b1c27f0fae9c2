within HystFMU.Functions;
function outputRow "Output row of the controllable canonical form in scaled time"
  extends Icons.Function;
  input Real b[:] "Numerator, highest power of s first";
  input Real a[:] "Denominator, highest power of s first";
  input Real sigma "Time scale";
  output Real c[size(a, 1) - 1] "Weights of the states, lowest power first";
protected
  Integer na = size(a, 1) - 1;
  Integer nb = size(b, 1) - 1;
  Real d = if size(b, 1) == size(a, 1) then b[1]/a[1] else 0;
algorithm
  for i in 1:size(a, 1) - 1 loop
    c[i] := (if i <= nb + 1 then b[max(nb + 2 - i, 1)]/a[1] else 0)/sigma^(na + 1 - i) - d*a[na + 2 - i]/a[1]/sigma^(na + 1 - i);
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> c_i = (b_i - d a_i)/a_1/sigma<sup>na + 1 - i</sup> with b_i, a_i the coefficients of s<sup>i - 1</sup> and d the direct term.</p>
<p><b>Source:</b> division of the polynomials, s = sigma p.</p>
<p><b>Limitations:</b> the degree of b must not exceed that of a.</p>
<p><b>Example:</b> <code>outputRow(b, a, sigma)</code> in <a href=\"modelica://HystFMU.Dynamics.TransferFunction\">Dynamics.TransferFunction</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.TransferFunction\">Dynamics.TransferFunction</a>, which uses it.</p>
</html>"));
end outputRow;
