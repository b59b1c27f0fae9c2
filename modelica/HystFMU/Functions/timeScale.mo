within HystFMU.Functions;
function timeScale "Rate that makes the coefficients of a denominator comparable"
  extends Icons.Function;
  input Real a[:] "Denominator, highest power of s first";
  output Real sigma(unit = "1/s") "Time scale";
algorithm
  sigma := if a[size(a, 1)] == 0 then 1 else abs(a[size(a, 1)]/a[1])^(1/(size(a, 1) - 1));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> sigma = abs(a_(na+1)/a_1)<sup>1/na</sup>, the geometric mean of the poles; 1 if there is a pole at 0.</p>
<p><b>Source:</b> Vieta's formula.</p>
<p><b>Limitations:</b> a[1] is not 0.</p>
</html>"));
end timeScale;
