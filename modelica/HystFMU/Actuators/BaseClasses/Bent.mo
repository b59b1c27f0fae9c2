within HystFMU.Actuators.BaseClasses;
partial model Bent "Operator in the slot of an actuator, with a bend and creep behind it"
  extends Hysteresis(final y_start = offset + scale*((1 + sum(creep))*Functions.bend(p_start, b0, knots, b) + beside_start));
  parameter Integer m(min = 1) = 1 "Number of dead zones of the bend" annotation (Dialog(group = "Sizes"));
  parameter Real b0 = 1 "Slope of the bend at 0" annotation (Dialog(group = "Bend"));
  parameter Real knots[m] = fill(0.5, m) "Thresholds of the dead zones; the sign is the side" annotation (Dialog(group = "Bend"));
  parameter Real b[m] = fill(0.0, m) "Weights of the dead zones" annotation (Dialog(group = "Bend"));
  parameter Integer lags(min = 1) = 1 "Number of lags of the creep" annotation (Dialog(group = "Sizes"));
  parameter Real creep[lags] = fill(0.0, lags) "Weights of the lags; 0: no creep" annotation (Dialog(group = "Creep"));
  parameter Types.Time T[lags](each min = 0) = fill(1.0, lags) "Time constants of the lags, greater than 0" annotation (Dialog(group = "Creep"));
  parameter Real p_start = 0 "Output of the operator at the start" annotation (Dialog(group = "Start"));
  parameter Real beside_start = 0 "What is added to it, at the start" annotation (Dialog(group = "Start"));
protected
  Real p "Output of the operator";
  Real dp(unit = "1/s") "Its rate";
  Real bent "Its bend";
  Real dbent(unit = "1/s") "Rate of the bend";
  Real l[lags] "Lags";
  Real dl[lags](each unit = "1/s") "Their rates";
  Real beside "What is added";
  Real dbeside(unit = "1/s") "Its rate";
equation
  bent = Functions.bend(p, b0, knots, b);
  dbent = Functions.bendSlope(p, b0, knots, b)*dp;
  for i in 1:lags loop
    dl[i] = (bent - l[i])/T[i];
    der(l[i]) = dl[i];
  end for;
  s = bent + creep*l + beside;
  ds = dbent + creep*dl + dbeside;
  kept = shift*s;
  lost = (x - shift)*ds;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> bent = b0 p + sum_j b_j S(p, knots_j), s = bent + sum_k creep_k L_{T_k}[bent] + beside, p the output of the operator.</p>
<p><b>Heat:</b> the stored energy is not known: heat is the whole power, and has either sign within a cycle.</p>
<p><b>Source:</b> Kuhnen, European Journal of Control 9 (2003) 407-418; creep: Krejci &amp; Kuhnen 2001.</p>
<p><b>Limitations:</b> those of the classes that extend it.</p>
</html>"));
end Bent;
