within HystFMU.Actuators.Hysteresis;
model Duhem "Duhem operator beside a linear term: passivity not shown"
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
  Real dw(unit = "1/s") "Its rate";
initial equation
  w = w_start;
equation
  assert(abs(w_start) <= w_max, "w_start must be within w_max, the bound of abs(w)");
  // at its bound the state stays until the slope points inwards, as the operator does it
  dw = noEvent(if dx > 0 then Functions.duhemSlope(x, min(max(w, -w_max), w_max), a_rise, b_rise, c_rise, q)*dx else Functions.duhemSlope(x, min(max(w, -w_max), w_max), a_fall, b_fall, c_fall, q)*dx);
  der(w) = noEvent(if w > w_max and dw > 0 or w < -w_max and dw < 0 then 0 else dw);
  s = k*x + w;
  ds = k*dx + der(w);
  y_rest = y_start;
  kept = shift*s;
  lost = (x - shift)*ds;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> s = k x + w, dw/dx = sum_i B_i(x) (a_i + sum_j (b_ij w<sup>j</sup> + c_ij abs(w) w<sup>j-1</sup>)), with other weights for rising and for falling x. The B_i are uniform B-splines on [-1, 1], see <a href=\"modelica://HystFMU.Functions.duhemSlope\">Functions.duhemSlope</a>.</p>
<p><b>Heat:</b> the whole power, of either sign within a cycle; passivity is not shown, so that a closed cycle may give energy back, and the actuator warns.</p>
<p><b>Source:</b> Oh &amp; Bernstein 2005; Coleman &amp; Hodgdon 1986.</p>
<p><b>Limitations:</b> the slope of s over x, k + dw/dx, must be greater than 0 on every branch: else the charge falls while the voltage rises, and the circuit jumps; no return-point memory: minor loops need not close.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.StackMovesMass\">Examples.StackMovesMass</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.BaseClasses.Hysteresis\">Actuators.BaseClasses.Hysteresis</a>, <a href=\"modelica://HystFMU.Operators.Smooth.Duhem\">Operators.Smooth.Duhem</a>.</p>
</html>"));
end Duhem;
