// generated from the table of fmu_build/core/blocks/networks/polynomial_narx.c by `make generate` - do not edit
within HystFMU.Networks.BaseClasses;
partial block PolynomialNarx "Polynomial of lagged inputs, auxiliary function and outputs (NFIR, NARX): parameters and ports"
  extends Icons.Block;
  parameter Integer n_u(min = 1) = 1 "Number of lags of u" annotation (Dialog(group = "Sizes"));
  parameter Integer n_f(min = 0) = 1 "Number of lags of f" annotation (Dialog(group = "Sizes"));
  parameter Integer n_y(min = 0) = 1 "Number of lags of y" annotation (Dialog(group = "Sizes"));
  parameter Integer q(min = 1) = 2 "Highest degree of a monomial" annotation (Dialog(group = "Sizes"));
  parameter Integer n_k(min = 0) = 1 "First lag of u and f; 0: direct feed-through" annotation (Dialog(group = "Sizes"));
  parameter Real theta[if q == 1 then n_u + n_f + n_y + 1 elseif q == 2 then div((n_u + n_f + n_y + 1)*(n_u + n_f + n_y + 2), 2) else div((n_u + n_f + n_y + 1)*(n_u + n_f + n_y + 2)*(n_u + n_f + n_y + 3), 6)] = fill(0.05, if q == 1 then n_u + n_f + n_y + 1 elseif q == 2 then div((n_u + n_f + n_y + 1)*(n_u + n_f + n_y + 2), 2) else div((n_u + n_f + n_y + 1)*(n_u + n_f + n_y + 2)*(n_u + n_f + n_y + 3), 6)) "Weights of the monomials by degree; the constant is last" annotation (Dialog(group = "Weights"));
  parameter Real y0 = 0 "Output before the first input" annotation (Dialog(group = "Start"));
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, 30}, {-100, 50}})));
  Interfaces.RealInput f "Auxiliary function of the input" annotation (Placement(transformation(extent = {{-120, -50}, {-100, -30}})));
  Interfaces.RealOutput y "Output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y_k = theta' phi(k), phi the monomials up to degree q of lags of u, f and y.</p>
<p><b>Source:</b> IPMC hysteresis model with basis function network, eq. 8-12; Leontaritis &amp; Billings 1985 (NARX).</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.PolynomialNarx\">Validation.PolynomialNarx</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Networks.PolynomialNarx\">Networks.PolynomialNarx</a>.</p>
</html>"));
end PolynomialNarx;
