within HystFMU.Actuators.BaseClasses;
partial model Bent "Operator in the slot of an actuator, with a bend and creep behind it"
  extends Hysteresis(final y_start = offset + scale*((1 + sum(creep))*((1 + g*theta_start)*Functions.bend(p_start, b0, knots, b) + theta_start*(g0 + Functions.bend(p_start, gb0, gknots, gb))) + beside_start));
  parameter Integer m(min = 1) = 1 "Number of dead zones of the bend" annotation (Dialog(group = "Sizes"));
  parameter Real b0 = 1 "Slope of the bend at 0" annotation (Dialog(group = "Bend"));
  parameter Real knots[m] = fill(0.5, m) "Thresholds of the dead zones; the sign is the side" annotation (Dialog(group = "Bend"));
  parameter Real b[m] = fill(0.0, m) "Weights of the dead zones" annotation (Dialog(group = "Bend"));
  parameter Integer lags(min = 1) = 1 "Number of lags of the creep" annotation (Dialog(group = "Sizes"));
  parameter Real creep[lags] = fill(0.0, lags) "Weights of the lags; 0: no creep" annotation (Dialog(group = "Creep"));
  parameter Types.Time T[lags](each min = 0) = fill(1.0, lags) "Time constants of the lags, greater than 0" annotation (Dialog(group = "Creep"));
  parameter Real T_gain(unit = "1/K") = 0 "Scaled temperature of 1 K; 0: nothing follows the temperature" annotation (Dialog(group = "Temperature"));
  parameter Types.Temperature T_middle = 293.15 "Temperature where nothing changes" annotation (Dialog(group = "Temperature"));
  parameter Types.Temperature T_min = 0 "Least temperature that is followed" annotation (Dialog(group = "Temperature"));
  parameter Types.Temperature T_max = 1e4 "Greatest temperature that is followed" annotation (Dialog(group = "Temperature"));
  parameter Real g = 0 "Change of the bend for a scaled temperature of 1, in parts" annotation (Dialog(group = "Temperature"));
  parameter Real g0 = 0 "Change of the output for a scaled temperature of 1" annotation (Dialog(group = "Temperature"));
  parameter Integer gm(min = 1) = 1 "Number of dead zones of the change of the bend" annotation (Dialog(group = "Sizes"));
  parameter Real gb0 = 0 "Slope at 0 of the change of the bend" annotation (Dialog(group = "Temperature"));
  parameter Real gknots[gm] = fill(0.5, gm) "Thresholds of its dead zones; the sign is the side" annotation (Dialog(group = "Temperature"));
  parameter Real gb[gm] = fill(0.0, gm) "Weights of its dead zones" annotation (Dialog(group = "Temperature"));
  parameter Types.Temperature T_start = 293.15 "Temperature at the start" annotation (Dialog(group = "Start"));
  parameter Real p_start = 0 "Output of the operator at the start" annotation (Dialog(group = "Start"));
  parameter Real beside_start = 0 "What is added to it, at the start" annotation (Dialog(group = "Start"));
protected
  parameter Real theta_start = T_gain*(min(max(T_start, T_min), T_max) - T_middle) "Scaled temperature at the start";
  parameter Boolean passiveBend = Functions.bendLeastSlope(b0, knots, b) >= 0 and max(abs(creep)) <= 0 and (abs(T_gain) <= 0 or max({abs(g), abs(gb0), max(abs(gb))}) <= 0) "Does what stands behind the operator leave it passive?";
  Real theta "Scaled temperature";
  Real p "Output of the operator";
  Real dp(unit = "1/s") "Its rate";
  Real bent "Its bend";
  Real dbent(unit = "1/s") "Rate of the bend";
  Real l[lags] "Lags";
  Real dl[lags](each unit = "1/s") "Their rates";
  Real beside "What is added";
  Real dbeside(unit = "1/s") "Its rate";
equation
  theta = T_gain*(min(max(temperature, T_min), T_max) - T_middle);
  bent = (1 + g*theta)*Functions.bend(p, b0, knots, b) + theta*(g0 + Functions.bend(p, gb0, gknots, gb));
  // a change of temperature is slow: its rate counts in no power
  dbent = ((1 + g*theta)*Functions.bendSlope(p, b0, knots, b) + theta*Functions.bendSlope(p, gb0, gknots, gb))*dp;
  for i in 1:lags loop
    dl[i] = (bent - l[i])/T[i];
    der(l[i]) = dl[i];
  end for;
  y_rest = offset + scale*((1 + sum(creep))*((1 + g*theta)*Functions.bend(p_start, b0, knots, b) + theta*(g0 + Functions.bend(p_start, gb0, gknots, gb))) + beside_start);
  s = bent + creep*l + beside;
  ds = dbent + creep*dl + dbeside;
  kept = shift*s;
  lost = (x - shift)*ds;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> bent = (1 + g theta) B(p) + theta (g0 + G(p)), B(p) = b0 p + sum_j b_j S(p, knots_j), G likewise, theta = T_gain (T - T_middle), s = bent + sum_k creep_k L_{T_k}[bent] + beside, p the output of the operator.</p>
<p><b>Heat:</b> the stored energy is not known: heat is the whole power, and has either sign within a cycle.</p>
<p><b>Source:</b> Kuhnen, European Journal of Control 9 (2003) 407-418; creep: Krejci &amp; Kuhnen 2001.</p>
<p><b>Limitations:</b> those of the classes that extend it.</p>
</html>"));
end Bent;
