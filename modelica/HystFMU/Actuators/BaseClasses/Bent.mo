within HystFMU.Actuators.BaseClasses;
partial model Bent "Hysteresis operator of an actuator, followed by a static nonlinearity and creep"
  extends Hysteresis(final y_start = offset + scale*((1 + sum(creep))*((1 + g*theta_start)*Functions.bend(p_start, b0, knots, b) + theta_start*(g0 + Functions.bend(p_start, gb0, gknots, gb))) + beside_start));
  parameter Integer m(min = 1) = 1 "Number of dead zones of the static nonlinearity" annotation (Dialog(group = "Sizes"));
  parameter Real b0 = 1 "Slope of the static nonlinearity at 0" annotation (Dialog(group = "Bend"));
  parameter Real knots[m] = fill(0.5, m) "Thresholds of the dead zones; the sign selects the side" annotation (Dialog(group = "Bend"));
  parameter Real b[m] = fill(0.0, m) "Weights of the dead zones" annotation (Dialog(group = "Bend"));
  parameter Integer lags(min = 1) = 1 "Number of lags of the creep" annotation (Dialog(group = "Sizes"));
  parameter Real creep[lags] = fill(0.0, lags) "Weights of the lags; 0: no creep" annotation (Dialog(group = "Creep"));
  parameter Types.Time T[lags](each min = 0) = fill(1.0, lags) "Time constants of the lags, greater than 0" annotation (Dialog(group = "Creep"));
  parameter Real T_gain(unit = "1/K") = 0 "Scaled temperature per kelvin; 0: the temperature has no effect" annotation (Dialog(group = "Temperature"));
  parameter Types.Temperature T_middle = 293.15 "Reference temperature, at which the temperature has no effect" annotation (Dialog(group = "Temperature"));
  parameter Types.Temperature T_min = 0 "Lower limit of the temperature" annotation (Dialog(group = "Temperature"));
  parameter Types.Temperature T_max = 1e4 "Upper limit of the temperature" annotation (Dialog(group = "Temperature"));
  parameter Real g = 0 "Relative change of the static nonlinearity at scaled temperature 1" annotation (Dialog(group = "Temperature"));
  parameter Real g0 = 0 "Change of the output at scaled temperature 1" annotation (Dialog(group = "Temperature"));
  parameter Integer gm(min = 1) = 1 "Number of dead zones of the temperature effect" annotation (Dialog(group = "Sizes"));
  parameter Real gb0 = 0 "Slope of the temperature effect at 0" annotation (Dialog(group = "Temperature"));
  parameter Real gknots[gm] = fill(0.5, gm) "Thresholds of the dead zones of the temperature effect; the sign selects the side" annotation (Dialog(group = "Temperature"));
  parameter Real gb[gm] = fill(0.0, gm) "Weights of the dead zones of the temperature effect" annotation (Dialog(group = "Temperature"));
  parameter Types.Temperature T_start = 293.15 "Initial temperature" annotation (Dialog(group = "Start"));
  parameter Real p_start = 0 "Initial output of the operator" annotation (Dialog(group = "Start"));
  parameter Real beside_start = 0 "Initial value of the parallel part" annotation (Dialog(group = "Start"));
protected
  parameter Real theta_start = T_gain*(min(max(T_start, T_min), T_max) - T_middle) "Initial scaled temperature";
  parameter Boolean passiveBend = Functions.bendLeastSlope(b0, knots, b) >= 0 and max(abs(creep)) <= 0 and (abs(T_gain) <= 0 or max({abs(g), abs(gb0), max(abs(gb))}) <= 0) "True if static nonlinearity and creep preserve passivity";
  Real theta "Scaled temperature";
  Real p "Output of the operator";
  Real dp(unit = "1/s") "Rate of p";
  Real bent "Output of the static nonlinearity";
  Real dbent(unit = "1/s") "Rate of bent";
  Real l[lags] "Lags";
  Real dl[lags](each unit = "1/s") "Rates of l";
  Real beside "Parallel part";
  Real dbeside(unit = "1/s") "Rate of beside";
equation
  theta = T_gain*(min(max(temperature, T_min), T_max) - T_middle);
  bent = (1 + g*theta)*Functions.bend(p, b0, knots, b) + theta*(g0 + Functions.bend(p, gb0, gknots, gb));
  // temperature changes slowly: its rate is neglected
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
<p><b>Equation:</b> bent = (1 + g theta) B(p) + theta (g0 + G(p)), B(p) = b0 p + sum_j b_j S(p, knots_j), G in the same form, theta = T_gain (T - T_middle), s = bent + sum_k creep_k L_{T_k}[bent] + beside, with p the output of the operator.</p>
<p><b>Heat:</b> the stored energy is not known. Therefore heat is the whole power, and its sign changes within a cycle.</p>
<p><b>Source:</b> Kuhnen, European Journal of Control 9 (2003) 407-418; creep: Krejci &amp; Kuhnen 2001.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
</html>"));
end Bent;
