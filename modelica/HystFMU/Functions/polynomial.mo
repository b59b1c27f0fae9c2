within HystFMU.Functions;
function polynomial "Polynomial of several variables with a weight for each monomial"
  extends Icons.Function;
  input Real z[:] "Variables";
  input Real theta[:] "Weights by degree; the constant is last";
  input Integer q "Highest degree, 1 to 3";
  output Real y "Value";
protected
  Integer p = size(z, 1);
  Integer n_2 "Index of the next weight of degree 2";
  Integer n_3 "Index of the next weight of degree 3";
algorithm
  y := theta[size(theta, 1)];
  n_2 := p;
  n_3 := p + div(p*(p + 1), 2);
  for i in 1:size(z, 1) loop
    y := y + z[i]*theta[i];
    for j in 1:size(z, 1) loop
      n_2 := if j >= i and q >= 2 then n_2 + 1 else n_2;
      y := y + (if j >= i and q >= 2 then z[i]*z[j]*theta[max(n_2, 1)] else 0);
      for l in 1:size(z, 1) loop
        n_3 := if j >= i and l >= j and q >= 3 then n_3 + 1 else n_3;
        y := y + (if j >= i and l >= j and q >= 3 then z[i]*z[j]*z[l]*theta[min(max(n_3, 1), size(theta, 1))] else 0);
      end for;
    end for;
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = theta' phi, phi: z_i, then z_i z_j with i &le; j row by row, then z_i z_j z_l with i &le; j &le; l, at last 1.</p>
<p><b>Source:</b> IPMC hysteresis model with basis function network, eq. 8-12.</p>
<p><b>Limitations:</b> degree 3 at most; the time grows with the cube of the number of variables.</p>
<p><b>Example:</b> <code>polynomial(cat(1, Functions.lagged(past_u, n_k, n_u), Functions.lagged(past_f, n_k, n_f), Functions.lagged(past_y, 0, n_y)), theta, q)</code> in <a href=\"modelica://HystFMU.Networks.PolynomialNarx\">Networks.PolynomialNarx</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Networks.PolynomialNarx\">Networks.PolynomialNarx</a>, which uses it.</p>
</html>"));
end polynomial;
