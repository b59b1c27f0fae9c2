// generated from the table of fmu_build/core/blocks/inverses/adaptive_inverse.c by `make generate` - do not edit
within HystFMU.Inverse.BaseClasses;
partial block AdaptiveInverse "Adaptive inverse of a Prandtl-Ishlinskii operator: learns its weights during operation: parameters and ports"
  extends Icons.Inverse;
  parameter Integer n(min = 1) = 10 "Number of play operators" annotation (Dialog(group = "Sizes"));
  parameter Integer delay(min = 0) = 1 "Steps until a command reaches the plant" annotation (Dialog(group = "Sizes"));
  parameter Real w0(min = 0) = 1 "Weight of the linear term at the start; greater than 0" annotation (Dialog(group = "Weights"));
  parameter Real r[n](each min = 0) = fill(0.1, n) "Thresholds (play half-widths), not decreasing" annotation (Dialog(group = "Thresholds"));
  parameter Real w[n](each min = 0) = fill(0.1, n) "Weights of the plays at the start" annotation (Dialog(group = "Weights"));
  parameter Real u0 = 0 "Initial memory: plant and plays rest at this value of u" annotation (Dialog(group = "Start"));
  parameter Types.Frequency f_n(min = 0) = 0 "Natural frequency of G0; 0: no dynamics" annotation (Dialog(group = "Dynamics"));
  parameter Real zeta(min = 0) = 0.7 "Damping ratio of G0" annotation (Dialog(group = "Dynamics"));
  parameter Types.Frequency f_h(min = 0) = 0 "Slower errors are not learned (0: all are learned)" annotation (Dialog(group = "Dynamics"));
  parameter Real sd[n + 1](each min = 0) = fill(0.05, n + 1) "Standard deviations of w0 and w after a sudden change" annotation (Dialog(group = "Adaptation"));
  parameter Real start(min = 0, max = 1) = 0.1 "Standard deviations at the start, relative to sd" annotation (Dialog(group = "Start"));
  parameter Types.Time T(min = 0) = 3 "Time in which the drift of a weight reaches sd; greater than 0" annotation (Dialog(group = "Adaptation"));
  parameter Real sigma(min = 0) = 0.01 "Standard deviation of the prediction error; greater than 0" annotation (Dialog(group = "Adaptation"));
  parameter Real change(min = 0) = 0.04 "Prediction error that indicates a sudden change; greater than 0" annotation (Dialog(group = "Adaptation"));
  parameter Types.Time pause(min = 0) = 0.2 "Shortest time between two sudden changes" annotation (Dialog(group = "Adaptation"));
  parameter Real box(min = 0) = 6 "Largest deviation of a weight from its initial value, in sd" annotation (Dialog(group = "Adaptation"));
  parameter Real w0_min(min = 0) = 0.1 "Lower limit of w0; greater than 0" annotation (Dialog(group = "Limits"));
  parameter Real u_min = -1e300 "Lower limit of u" annotation (Dialog(group = "Limits"));
  parameter Real u_max = 1e300 "Upper limit of u" annotation (Dialog(group = "Limits"));
  Interfaces.RealInput v "Wanted output of the operator" annotation (Placement(transformation(extent = {{-120, 43}, {-100, 63}})));
  Interfaces.RealInput y_d "Reference; the weights change only while it moves" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput y "Measured output of the plant" annotation (Placement(transformation(extent = {{-120, -64}, {-100, -44}})));
  Interfaces.RealOutput u "Operator input for the output v" annotation (Placement(transformation(extent = {{100, 54}, {120, 74}})));
  Interfaces.RealOutput theta[n + 1] "Current weights w0 and w" annotation (Placement(transformation(extent = {{100, 22}, {120, 42}})));
  Interfaces.RealOutput y_hat "Prediction of y before the update of the weights" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  Interfaces.RealOutput gate "1 if the sample updated the weights" annotation (Placement(transformation(extent = {{100, -42}, {120, -22}})));
  Interfaces.RealOutput changes "Number of sudden changes" annotation (Placement(transformation(extent = {{100, -74}, {120, -54}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> u such that w0 u + sum_i w_i p_{r_i}[u] = v; theta = (w0, w) += K (y - theta' phi) while y_d moves, K = P phi / (sigma<sup>2</sup> + phi' P phi), P &lt;- P - K phi' P + dt / T diag(sd<sup>2</sup>), phi = G0 z<sup>-delay</sup> (u, p_{r_i}[u]).</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 10-14; Ljung &amp; Gunnarsson, Automatica 26 (1990) 7.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.AdaptiveInverse\">Validation.AdaptiveInverse</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.AdaptiveInverse\">Inverse.AdaptiveInverse</a>.</p>
</html>"));
end AdaptiveInverse;
