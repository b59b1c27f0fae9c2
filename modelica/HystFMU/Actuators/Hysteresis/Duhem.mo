within HystFMU.Actuators.Hysteresis;
model Duhem "Duhem operator in parallel to a linear term; passivity not proven"
  extends BaseClasses.Hysteresis(final passive = false, final y_start = offset + scale*(k*x_start + w_start));
  extends Icons.Smooth;
  parameter Integer n(min = 0) = 0 "Number of B-splines of the scaled voltage, less 1" annotation (Dialog(group = "Sizes"));
  parameter Integer q(min = 1) = 1 "Degree in the state" annotation (Dialog(group = "Sizes"));
  parameter Real k = 0.5 "Slope of the linear term" annotation (Dialog(group = "Operator"));
  parameter Real a_rise[n + 1] = fill(0.5, n + 1) "Rising voltage: weights of B_i(x)" annotation (Dialog(group = "Weights"));
  parameter Real b_rise[(n + 1)*q] = fill(-0.5, (n + 1)*q) "Rising voltage: weights of B_i w^j, one row per i" annotation (Dialog(group = "Weights"));
  parameter Real c_rise[(n + 1)*q] = fill(-0.5, (n + 1)*q) "Rising voltage: weights of B_i abs(w) w^(j-1)" annotation (Dialog(group = "Weights"));
  parameter Real a_fall[n + 1] = fill(0.5, n + 1) "Falling voltage: weights of B_i(x)" annotation (Dialog(group = "Weights"));
  parameter Real b_fall[(n + 1)*q] = fill(0.5, (n + 1)*q) "Falling voltage: weights of B_i w^j, one row per i" annotation (Dialog(group = "Weights"));
  parameter Real c_fall[(n + 1)*q] = fill(-0.5, (n + 1)*q) "Falling voltage: weights of B_i abs(w) w^(j-1)" annotation (Dialog(group = "Weights"));
  parameter Real w_max(min = 0, max = 1e100) = 1e100 "Bound of abs(w), greater than 0" annotation (Dialog(group = "Limits"));
  parameter Real w_start = 0 "State at u_start" annotation (Dialog(group = "Start"));
protected
  Real w "State";
  Real dw(unit = "1/s") "Rate of w";
initial equation
  w = w_start;
equation
  assert(abs(w_start) <= w_max, "abs(w_start) must be at most w_max");
  // like the operator, the state stays at its bound until the slope points inwards
  dw = noEvent(if dx > 0 then Functions.duhemSlope(x, min(max(w, -w_max), w_max), a_rise, b_rise, c_rise, q)*dx else Functions.duhemSlope(x, min(max(w, -w_max), w_max), a_fall, b_fall, c_fall, q)*dx);
  der(w) = noEvent(if w > w_max and dw > 0 or w < -w_max and dw < 0 then 0 else dw);
  s = k*x + w;
  ds = k*dx + der(w);
  y_rest = y_start;
  kept = shift*s;
  lost = (x - shift)*ds;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> s = k x + w, dw/dx = sum_i B_i(x) (a_i + sum_j (b_ij w<sup>j</sup> + c_ij abs(w) w<sup>j-1</sup>)), with different weights for rising and falling x. The B_i are uniform B-splines on [-1, 1], see <a href=\"modelica://HystFMU.Functions.duhemSlope\">Functions.duhemSlope</a>.</p>
<p><b>Heat:</b> heat is the whole power; its sign changes within a cycle. Passivity is not proven: a closed cycle may generate energy, and the actuator warns of this.</p>
<p><b>Source:</b> Oh &amp; Bernstein 2005; Coleman &amp; Hodgdon 1986.</p>
<p><b>Limitations:</b> ds/dx = k + dw/dx must be greater than 0 on every branch, otherwise the charge falls while the voltage rises and the circuit jumps. There is no return-point memory, so minor loops do not always close.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.StackMovesMass\">Examples.StackMovesMass</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.BaseClasses.Hysteresis\">Actuators.BaseClasses.Hysteresis</a>, <a href=\"modelica://HystFMU.Operators.Smooth.Duhem\">Operators.Smooth.Duhem</a>.</p>
</html>"));
end Duhem;
