within HystFMU.Functions;
function xorShift64 "Exclusive or of a number and the number shifted right"
  extends Icons.Function;
  input Real z[4] "Number: four parts of 16 bits, lowest first";
  input Integer shift "Number of bits, 17 to 31";
  output Real y[4] "Result: four parts of 16 bits";
protected
  Real low = 2^(shift - 16) "Factor of the shift beyond 16 bits";
  Real shifted[4];
  Real a;
  Real b;
algorithm
  shifted := zeros(4);
  shifted[1] := floor(z[2]/low) + mod(z[3], low)*65536/low;
  shifted[2] := floor(z[3]/low) + mod(z[4], low)*65536/low;
  shifted[3] := floor(z[4]/low);
  y := zeros(4);
  for i in 1:4 loop
    for k in 0:15 loop
      a := mod(floor(z[i]/2^k), 2);
      b := mod(floor(shifted[i]/2^k), 2);
      y[i] := y[i] + abs(a - b)*2^k;
    end for;
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = z xor (z &gt;&gt; shift).</p>
<p><b>Source:</b> definition.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>xorShift64(z, 30)</code> in <a href=\"modelica://HystFMU.Functions.randomUniform\">Functions.randomUniform</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.randomUniform\">Functions.randomUniform</a>, which uses it.</p>
</html>"));
end xorShift64;
