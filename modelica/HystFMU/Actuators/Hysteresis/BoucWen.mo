within HystFMU.Actuators.Hysteresis;
model BoucWen "Bouc-Wen operator in parallel to a curve and lags; passivity not proven"
  extends BaseClasses.Parallel(final passive = false, final m = 1, final b0 = 1, final knots = {0.5}, final b = {0.0}, final p_start = w0*x_start + w*z0);
  extends Icons.Smooth;
  parameter Real A(min = 1e-100, max = 1e100) = 1 "Slope of z at z = 0" annotation (Dialog(group = "Operator"));
  parameter Real beta(min = 0, max = 1e100) = 0.5 "Width of the loop" annotation (Dialog(group = "Operator"));
  parameter Real gamma(min = -1e100, max = 1e100) = 0.5 "Shape of the loop; beta + gamma > 0" annotation (Dialog(group = "Operator"));
  parameter Real knee(min = 1, max = 20) = 1 "Sharpness of the knee" annotation (Dialog(group = "Operator"));
  parameter Real w0 = 1 "Weight of the linear term" annotation (Dialog(group = "Weights"));
  parameter Real w = -0.5 "Weight of z" annotation (Dialog(group = "Weights"));
  parameter Real z0 = 0 "Hysteretic part at u_start, at most (A/(beta + gamma))^(1/knee) in absolute value" annotation (Dialog(group = "Start"));
protected
  Real z "Hysteretic part";
  Real dz(unit = "1/s") "Rate of z";
initial equation
  z = z0;
  dl = zeros(lags);
equation
  assert(beta + gamma > 0, "beta + gamma must be greater than 0, else z is unbounded");
  assert((beta + gamma)*abs(z0)^knee <= A, "abs(z0) must be at most (A/(beta + gamma))^(1/knee)");
  assert(Functions.bendLeastSlope(c0, knots_x, curve) + w0 + min({0, w*A, 2*w*A*beta/(beta + gamma)}) > 0, "w0 or the slope of the curve must be larger: the charge falls after a reversal while the voltage rises");
  dz = Functions.boucWenRate(dx, z, A, beta, gamma, knee);
  der(z) = dz;
  p = w0*x + w*z;
  dp = w0*dx + w*dz;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> p = w0 x + w z, z' = A x' - beta abs(x') abs(z)<sup>knee-1</sup> z - gamma x' abs(z)<sup>knee</sup>; BaseClasses.Parallel computes s from p.</p>
<p><b>Heat:</b> heat is the whole power; its sign changes within a cycle. Passivity is not proven: a closed cycle may generate energy, and the actuator warns of this.</p>
<p><b>Source:</b> Wen 1976; Ikhouane &amp; Rodellar 2007, chapter 2.</p>
<p><b>Limitations:</b> ds/dx, the slope of the curve plus w0 + w z'/x', must be greater than 0 on every branch; minor loops do not always close.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.StackMovesMass\">Examples.StackMovesMass</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.BaseClasses.Hysteresis\">Actuators.BaseClasses.Hysteresis</a>, <a href=\"modelica://HystFMU.Operators.Smooth.BoucWen\">Operators.Smooth.BoucWen</a>.</p>
</html>"));
end BoucWen;
