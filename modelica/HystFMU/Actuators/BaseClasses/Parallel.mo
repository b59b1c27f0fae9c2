within HystFMU.Actuators.BaseClasses;
partial model Parallel "Operator with static nonlinearity, in parallel to a curve, lags and a nonlinear lag of the voltage"
  extends Bent(final beside_start = Functions.bend(x_start, c0, knots_x, curve) + sum(creep_x)*x_start + Functions.bend(x_start - middle, 0, knots_lag, widening));
  parameter Integer m_x(min = 1) = 1 "Number of dead zones of the curve" annotation (Dialog(group = "Sizes"));
  parameter Real c0 = 0 "Slope of the curve at 0" annotation (Dialog(group = "Curve"));
  parameter Real knots_x[m_x] = fill(0.5, m_x) "Thresholds of the dead zones; the sign selects the side" annotation (Dialog(group = "Curve"));
  parameter Real curve[m_x] = fill(0.0, m_x) "Weights of the dead zones" annotation (Dialog(group = "Curve"));
  parameter Integer lags_x(min = 1) = 1 "Number of lags of the voltage" annotation (Dialog(group = "Sizes"));
  parameter Real creep_x[lags_x] = fill(0.0, lags_x) "Weights of the lags of the scaled voltage" annotation (Dialog(group = "Creep"));
  parameter Types.Time T_x[lags_x](each min = 0) = fill(1.0, lags_x) "Time constants of the lags, greater than 0" annotation (Dialog(group = "Creep"));
  parameter Integer m_lag(min = 1) = 1 "Number of dead zones after the nonlinear lag" annotation (Dialog(group = "Sizes"));
  parameter Types.Time T_lag(min = 0) = 1 "Time constant of the nonlinear lag, greater than 0" annotation (Dialog(group = "Nonlinear lag"));
  parameter Real middle = 0 "Scaled voltage at which the thresholds are zero" annotation (Dialog(group = "Nonlinear lag"));
  parameter Real knots_lag[m_lag] = fill(0.5, m_lag) "Thresholds of the dead zones; the sign selects the side" annotation (Dialog(group = "Nonlinear lag"));
  parameter Real widening[m_lag] = fill(0.0, m_lag) "Weights of the dead zones" annotation (Dialog(group = "Nonlinear lag"));
protected
  parameter Boolean passiveBeside = passiveBend and Functions.bendLeastSlope(c0, knots_x, curve) >= 0 and min(creep_x) >= 0 and max(abs(widening)) <= 0 "True if static nonlinearity and parallel part preserve passivity";
  Real q[lags_x] "Lags of the scaled voltage";
  Real dq[lags_x](each unit = "1/s") "Rates of q";
  Real late "Lag of the scaled voltage for the dead zones";
  Real dlate(unit = "1/s") "Rate of late";
initial equation
  dq = zeros(lags_x);
  dlate = 0;
equation
  for i in 1:lags_x loop
    dq[i] = (x - q[i])/T_x[i];
    der(q[i]) = dq[i];
  end for;
  dlate = (x - late)/T_lag;
  der(late) = dlate;
  beside = Functions.bend(x, c0, knots_x, curve) + creep_x*q + Functions.bend(late - middle, 0, knots_lag, widening);
  dbeside = Functions.bendSlope(x, c0, knots_x, curve)*dx + creep_x*dq + Functions.bendSlope(late - middle, 0, knots_lag, widening)*dlate;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> beside = c0 x + sum_j curve_j S(x, knots_x_j) + sum_k creep_x_k L_{T_x_k}[x] + sum_i widening_i S(L_{T_lag}[x] - middle, knots_lag_i).</p>
<p><b>Heat:</b> as in BaseClasses.Bent. Over a closed cycle, the loss of a rising curve is 0 and the loss of a lag with positive weight is positive.</p>
<p><b>Source:</b> the kinds preisach and bouc_wen_parallel of HystFMU; spring and dashpot beside an operator: Spencer, Dyke, Sain &amp; Carlson, Journal of Engineering Mechanics 123 (1997) 230-238.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
</html>"));
end Parallel;
