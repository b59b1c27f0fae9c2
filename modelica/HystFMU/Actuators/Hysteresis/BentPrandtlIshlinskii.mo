within HystFMU.Actuators.Hysteresis;
model BentPrandtlIshlinskii "Sum of plays, bend and creep: the structured actuator without its dynamics"
  extends BaseClasses.Hysteresis(final passive = scale > 0 and w0 >= 0 and min(w) >= 0 and Functions.bendLeastSlope(b0, knots, b) >= 0 and max(abs(creep)) <= 0, final y_start = offset + scale*(1 + sum(creep))*Functions.bend((w0 + sum(w))*x_start, b0, knots, b));
  extends Icons.Smooth;
  parameter Integer n(min = 1) = 10 "Number of plays" annotation (Dialog(group = "Sizes"));
  parameter Real w0 = 0.3 "Weight of the linear term" annotation (Dialog(group = "Parameters"));
  parameter Real r[n](each min = 0) = linspace(0.05, 0.5, n) "Half-widths of the plays, of the scaled voltage, not decreasing" annotation (Dialog(group = "Parameters"));
  parameter Real w[n] = fill(0.1, n) "Weights of the plays" annotation (Dialog(group = "Parameters"));
  parameter Integer m(min = 1) = 1 "Number of dead zones of the bend" annotation (Dialog(group = "Sizes"));
  parameter Real b0 = 1 "Slope of the bend at 0" annotation (Dialog(group = "Bend"));
  parameter Real knots[m] = fill(0.5, m) "Thresholds of the dead zones; the sign is the side" annotation (Dialog(group = "Bend"));
  parameter Real b[m] = fill(0.2, m) "Weights of the dead zones" annotation (Dialog(group = "Bend"));
  parameter Integer lags(min = 1) = 1 "Number of lags of the creep" annotation (Dialog(group = "Sizes"));
  parameter Real creep[lags] = fill(0.0, lags) "Weights of the lags; 0: no creep" annotation (Dialog(group = "Creep"));
  parameter Types.Time T[lags](each min = 0) = fill(1.0, lags) "Time constants of the lags, greater than 0" annotation (Dialog(group = "Creep"));
  parameter Real width(min = 0) = 1e-3*max(max(r), 1e-300) "Scaled voltage on which the corner of a play is rounded, greater than 0" annotation (Dialog(tab = "Advanced"));
protected
  Real z[n] "Plays";
  Real dz[n](each unit = "1/s") "Their rates";
  Real v "Sum of plays";
  Real bent "Its bend";
  Real dbent(unit = "1/s") "Rate of the bend";
  Real l[lags] "Lags";
  Real dl[lags](each unit = "1/s") "Their rates";
initial equation
  z = Functions.play(x, r, fill(x_start, n));
  dl = zeros(lags);
equation
  for i in 1:n loop
    dz[i] = Functions.playRate(x, dx, r[i], z[i], width);
    der(z[i]) = dz[i];
  end for;
  v = w0*x + w*z;
  bent = Functions.bend(v, b0, knots, b);
  dbent = Functions.bendSlope(v, b0, knots, b)*(w0*dx + w*dz);
  for i in 1:lags loop
    dl[i] = (bent - l[i])/T[i];
    der(l[i]) = dl[i];
  end for;
  s = bent + creep*l;
  ds = dbent + creep*dl;
  kept = shift*s;
  lost = (x - shift)*ds;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> v = w0 x + sum_i w_i p_{r_i}[x], bent = b0 v + sum_j b_j S(v, knots_j), s = bent + sum_k creep_k L_{T_k}[bent].</p>
<p><b>Source:</b> Kuhnen, European Journal of Control 9 (2003) 407-418; creep: Krejci &amp; Kuhnen 2001.</p>
<p><b>Limitations:</b> a play lags behind the exact one by at most width; the stored energy is not known, so that heat is the whole power, whose mean over a closed cycle is not negative for weights that are not negative, a bend that rises, and no creep; with creep passivity is not shown.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.StackMovesMass\">Examples.StackMovesMass</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.BaseClasses.Hysteresis\">Actuators.BaseClasses.Hysteresis</a>, <a href=\"modelica://HystFMU.Operators.DeadZones\">Operators.DeadZones</a>, <a href=\"modelica://HystFMU.Operators.Smooth.Creep\">Operators.Smooth.Creep</a>, <a href=\"modelica://HystFMU.Actuators.Hysteresis.PrandtlIshlinskii\">Actuators.Hysteresis.PrandtlIshlinskii</a>, <a href=\"modelica://HystFMU.Actuators.Hysteresis.Preisach\">Actuators.Hysteresis.Preisach</a>, <a href=\"modelica://HystFMU.Actuators.Hysteresis.KrasnoselskiiPokrovskii\">Actuators.Hysteresis.KrasnoselskiiPokrovskii</a>, <a href=\"modelica://HystFMU.Actuators.Hysteresis.PlayBankMlp\">Actuators.Hysteresis.PlayBankMlp</a>.</p>
</html>"));
end BentPrandtlIshlinskii;
