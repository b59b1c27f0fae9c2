// generated from the table of fmu_build/core/blocks/networks/recursive_least_squares.c by `make generate` - do not edit
within HystFMU.Networks.BaseClasses;
partial block RecursiveLeastSquares "Recursive least squares with a dead zone: learns the weights of regressors during operation: parameters and ports"
  extends Icons.Block;
  parameter Integer n(min = 1) = 2 "Number of weights" annotation (Dialog(group = "Sizes"));
  parameter Types.Recursion form = Types.Recursion.corrected "Update: corrected, as printed, or without dead zone" annotation (Dialog(group = "Network"));
  parameter Real theta0[n] = fill(0.0, n) "Initial weights" annotation (Dialog(group = "Start"));
  parameter Real eta(min = 0) = 100 "Initial covariance P(0) = eta I; greater than 0" annotation (Dialog(group = "Start"));
  parameter Real mu(min = 0, max = 1) = 0.999 "Forgetting factor; 1: none; greater than 0" annotation (Dialog(group = "Network"));
  parameter Real r(min = 0) = 0.05 "Dead zone: errors up to r are ignored; greater than 0" annotation (Dialog(group = "Thresholds"));
  parameter Real share(min = 0, max = 1) = 1 "Gain beta relative to its bound mu Sigma; greater than 0" annotation (Dialog(group = "Gains"));
  Interfaces.RealInput phi[n] "Regressors" annotation (Placement(transformation(extent = {{-120, 30}, {-100, 50}})));
  Interfaces.RealInput y "Measured output" annotation (Placement(transformation(extent = {{-120, -50}, {-100, -30}})));
  Interfaces.RealOutput y_hat "Prediction of y before the update of the weights" annotation (Placement(transformation(extent = {{100, 43}, {120, 63}})));
  Interfaces.RealOutput theta[n] "Weights after the update" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  Interfaces.RealOutput learned "Number of updates since P was eta I" annotation (Placement(transformation(extent = {{100, -64}, {120, -44}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> e = y - phi' theta, theta += P phi s e / ((1 + s) phi' P phi), s = share (e<sup>2</sup> - r<sup>2</sup>) / r<sup>2</sup> while |e| &gt; r, P &lt;- (P - s / (1 + s) P phi phi' P / phi' P phi) / mu.</p>
<p><b>Source:</b> IPMC hysteresis model with basis function network, eq. 13-19; Bierman, Automatica 12 (1976) 375.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.RecursiveLeastSquares\">Validation.RecursiveLeastSquares</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Networks.RecursiveLeastSquares\">Networks.RecursiveLeastSquares</a>.</p>
</html>"));
end RecursiveLeastSquares;
