within HystFMU.Functions;
function multiply64 "Product of two whole numbers modulo 2^64"
  extends Icons.Function;
  input Real a[4] "First number: four parts of 16 bits, lowest first";
  input Real b[4] "Second number: four parts of 16 bits";
  output Real c[4] "Product: four parts of 16 bits";
protected
  Real carry;
algorithm
  c := zeros(4);
  carry := 0;
  for k in 1:4 loop
    c[k] := carry;
    for i in 1:k loop
      c[k] := c[k] + a[i]*b[k + 1 - i];
    end for;
    carry := floor(c[k]/65536);
    c[k] := c[k] - 65536*carry;
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> c = a b mod 2<sup>64</sup>, long multiplication.</p>
<p><b>Source:</b> definition.</p>
<p><b>Limitations:</b> every sum is below 2<sup>53</sup>, so Real arithmetic is exact.</p>
<p><b>Example:</b> <code>multiply64({mod(k + 1, 65536), mod(floor((k + 1)/65536), 65536), mod(floor((k + 1)/4294967296), 65536), 0}, {31765, 32586, 31161, 40503})</code> in <a href=\"modelica://HystFMU.Functions.randomUniform\">Functions.randomUniform</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.randomUniform\">Functions.randomUniform</a>, which uses it.</p>
</html>"));
end multiply64;
