// generated from the table of fmu_build/core/blocks/dynamics/product.c by `make generate` - do not edit
within HystFMU.Dynamics.BaseClasses;
partial block Product "Product of signals, divided by a product of other signals: parameters and ports"
  extends Icons.Block;
  parameter Integer n(min = 1) = 2 "Number of factors" annotation (Dialog(group = "Sizes"));
  parameter Integer m(min = 0) = 1 "Number of divisors" annotation (Dialog(group = "Sizes"));
  parameter Real least(min = 1e-150) = 0.001 "Smallest absolute value of a divisor" annotation (Dialog(group = "Limits"));
  Interfaces.RealInput u[n + m] "The factors, then the divisors" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y "Product of the factors / product of the divisors" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = u_1 .. u_n / (u_(n+1) .. u_(n+m)), each |divisor| at least `least`.</p>
<p><b>Source:</b> gain scheduling (Rugh &amp; Shamma 2000).</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Product\">Validation.Product</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.Product\">Dynamics.Product</a>.</p>
</html>"));
end Product;
