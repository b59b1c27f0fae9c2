within HystFMU.Dynamics;
block Product "Product of signals, divided by a product of other signals"
  extends BaseClasses.Product;
protected
  Real factor[n + 1] "Products of the first 0, 1, .. n factors";
  Real quotient[m + 1] "Product of the factors divided by the first 0, 1, .. m divisors";
equation
  factor[1] = 1;
  for i in 1:n loop
    factor[i + 1] = factor[i]*u[i];
  end for;
  quotient[1] = factor[n + 1];
  for j in 1:m loop
    quotient[j + 1] = quotient[j]/(if u[n + j] >= least or u[n + j] <= -least then u[n + j] elseif u[n + j] < 0 then
      -least else least);
  end for;
  y = quotient[m + 1];
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> none.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.BaseClasses.Product\">Dynamics.BaseClasses.Product</a>: equation, source, example.</p>
</html>"));
end Product;
