within HystFMU.Actuators.Hysteresis;
model JilesAtherton "Jiles-Atherton operator with a linear and a quadratic term; passivity not proven"
  extends BaseClasses.Hysteresis(final passive = false, final y_start = offset + scale*(w0*x_start + (w + w2*M_start)*M_start));
  extends Icons.Smooth;
  parameter Real a(min = 1e-100, max = 1e100) = 0.3 "Shape of the anhysteretic curve" annotation (Dialog(group = "Operator"));
  parameter Real k(min = 1e-100, max = 1e100) = 0.25 "Pinning of the domain walls, approximately the coercive field" annotation (Dialog(group = "Operator"));
  parameter Real c(min = 0, max = 1) = 0.1 "Reversible share" annotation (Dialog(group = "Operator"));
  parameter Real alpha(min = -1e100, max = 1e100) = 0.05 "Mean field for M = 1; alpha < 3 a" annotation (Dialog(group = "Operator"));
  parameter Real w0 = 0.1 "Weight of the field" annotation (Dialog(group = "Weights"));
  parameter Real w = 1 "Weight of the magnetisation" annotation (Dialog(group = "Weights"));
  parameter Real w2 = 0 "Weight of the square of the magnetisation" annotation (Dialog(group = "Weights"));
  parameter Real m_start = 0 "Irreversible part of the magnetisation at u_start" annotation (Dialog(group = "Start"));
protected
  parameter Real M_start = Functions.jilesAthertonOutput(x_start, m_start, 1, a, c, alpha) "Initial magnetisation";
  Real M "Magnetisation divided by its saturation value";
  Real dM(unit = "1/s") "Rate of M";
  Real h = (x + alpha*M)/a "Effective field in units of a";
  Real beyond = Functions.langevin(h) - M "Anhysteretic curve minus magnetisation";
  Real slope = noEvent(c/a*Functions.langevinSlope(h) + max(if dx > 0 then beyond else -beyond, 0)/k) "dM/dh";
initial equation
  M = M_start;
equation
  assert(alpha < 3*a, "alpha must be less than 3 a, otherwise the anhysteretic curve jumps");
  assert(w > 2*abs(w2), "w must be greater than 2 abs(w2), otherwise the stroke falls while the field rises");
  dM = slope/(1 - alpha*slope)*dx;
  der(M) = dM;
  s = w0*x + (w + w2*M)*M;
  ds = w0*dx + (w + 2*w2*M)*dM;
  y_rest = y_start;
  kept = shift*s;
  lost = (x - shift)*ds;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> s = w0 x + w M + w2 M<sup>2</sup>, M from x as in Operators.BaseClasses.JilesAtherton with Ms = 1.</p>
<p><b>Heat:</b> heat is the whole power; its sign changes within a cycle. Passivity is not proven: a closed cycle may generate energy, and the actuator warns of this.</p>
<p><b>Source:</b> Jiles &amp; Atherton 1986, J. Magn. Magn. Mater. 61, 48; Jiles 1995, J. Phys. D 28, 1537, for the square in a strain.</p>
<p><b>Limitations:</b> ds/dx = w0 + (w + 2 w2 M) M'/x' must be greater than 0 on every branch; minor loops do not always close.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MagnetostrictiveRod\">Examples.MagnetostrictiveRod</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.BaseClasses.Hysteresis\">Actuators.BaseClasses.Hysteresis</a>, <a href=\"modelica://HystFMU.Operators.Smooth.JilesAtherton\">Operators.Smooth.JilesAtherton</a>.</p>
</html>"));
end JilesAtherton;
