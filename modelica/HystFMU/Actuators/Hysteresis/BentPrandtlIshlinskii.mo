within HystFMU.Actuators.Hysteresis;
model BentPrandtlIshlinskii "Sum of plays, static nonlinearity and creep: the kind actuator without dynamics"
  extends BaseClasses.Bent(final passive = scale > 0 and w0 >= 0 and min(w) >= 0 and passiveBend, b = fill(0.2, m), final p_start = (w0 + sum(w))*x_start, final beside_start = 0);
  extends Icons.Smooth;
  parameter Integer n(min = 1) = 10 "Number of plays" annotation (Dialog(group = "Sizes"));
  parameter Real w0 = 0.3 "Weight of the linear term" annotation (Dialog(group = "Parameters"));
  parameter Real r[n](each min = 0) = linspace(0.05, 0.5, n) "Half-widths of the plays in scaled voltage, not decreasing" annotation (Dialog(group = "Parameters"));
  parameter Real w[n] = fill(0.1, n) "Weights of the plays" annotation (Dialog(group = "Parameters"));
  parameter Real width(min = 0) = 1e-3*max(max(r), 1e-300) "Width of the rounded corner of a play in scaled voltage, greater than 0" annotation (Dialog(tab = "Advanced"));
protected
  Real z[n] "Plays";
  Real dz[n](each unit = "1/s") "Rates of z";
initial equation
  z = Functions.play(x, r, fill(x_start, n));
  dl = zeros(lags);
equation
  for i in 1:n loop
    dz[i] = Functions.playRate(x, dx, r[i], z[i], width);
    der(z[i]) = dz[i];
  end for;
  p = w0*x + w*z;
  dp = w0*dx + w*dz;
  beside = 0;
  dbeside = 0;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> p = w0 x + sum_i w_i p_{r_i}[x], bent = b0 p + sum_j b_j S(p, knots_j), s = bent + sum_k creep_k L_{T_k}[bent].</p>
<p><b>Heat:</b> heat is the whole power; its sign changes within a cycle. Its mean over each closed cycle is &ge; 0 if no weight is negative, the static nonlinearity rises and there is no creep. Otherwise passivity is not proven.</p>
<p><b>Source:</b> Kuhnen, European Journal of Control 9 (2003) 407-418; creep: Krejci &amp; Kuhnen 2001.</p>
<p><b>Limitations:</b> a play differs from the exact play by at most width.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.StackMovesMass\">Examples.StackMovesMass</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.BaseClasses.Hysteresis\">Actuators.BaseClasses.Hysteresis</a>, <a href=\"modelica://HystFMU.Operators.DeadZones\">Operators.DeadZones</a>, <a href=\"modelica://HystFMU.Operators.Smooth.Creep\">Operators.Smooth.Creep</a>, <a href=\"modelica://HystFMU.Actuators.Hysteresis.PrandtlIshlinskii\">Actuators.Hysteresis.PrandtlIshlinskii</a>, <a href=\"modelica://HystFMU.Actuators.Hysteresis.Preisach\">Actuators.Hysteresis.Preisach</a>, <a href=\"modelica://HystFMU.Actuators.Hysteresis.KrasnoselskiiPokrovskii\">Actuators.Hysteresis.KrasnoselskiiPokrovskii</a>, <a href=\"modelica://HystFMU.Actuators.Hysteresis.PlayBankMlp\">Actuators.Hysteresis.PlayBankMlp</a>.</p>
</html>"));
end BentPrandtlIshlinskii;
