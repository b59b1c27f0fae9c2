within HystFMU.Actuators.Hysteresis;
model PrandtlIshlinskii "Sum of plays; passive if no weight is negative"
  extends BaseClasses.Hysteresis(final instantaneous = passive, final passive = scale > 0 and w0 >= 0 and min(w) >= 0, final y_start = offset + scale*(w0 + sum(w))*x_start);
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
equation
  for i in 1:n loop
    dz[i] = Functions.playRate(x, dx, r[i], z[i], width);
    der(z[i]) = dz[i];
  end for;
  s = w0*x + w*z;
  ds = w0*dx + w*dz;
  y_rest = y_start;
  kept = 0.5*w0*x^2 + 0.5*sum(w[i]*z[i]^2 for i in 1:n);
  lost = sum(w[i]*(x - z[i])*dz[i] for i in 1:n);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> s = w0 x + sum_i w_i p_{r_i}[x]; kept = w0 x<sup>2</sup>/2 + sum_i w_i z_i<sup>2</sup>/2; lost = sum_i w_i (x - z_i) z_i', which is w_i r_i abs(z_i') for sharp corners.</p>
<p><b>Heat:</b> heat &ge; 0 at every instant if no weight is negative. Otherwise passivity is not proven: a closed cycle may generate energy.</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 5-9; energies of plays: Brokate &amp; Sprekels, Hysteresis and Phase Transitions 1996, chapter 2.</p>
<p><b>Limitations:</b> a play lags behind the exact one by at most width; all plays start from u_start.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.StackMovesMass\">Examples.StackMovesMass</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.BaseClasses.Hysteresis\">Actuators.BaseClasses.Hysteresis</a>, <a href=\"modelica://HystFMU.Operators.Smooth.PrandtlIshlinskii\">Operators.Smooth.PrandtlIshlinskii</a>, <a href=\"modelica://HystFMU.Actuators.Hysteresis.BentPrandtlIshlinskii\">Actuators.Hysteresis.BentPrandtlIshlinskii</a>, <a href=\"modelica://HystFMU.Actuators.Hysteresis.Preisach\">Actuators.Hysteresis.Preisach</a>, <a href=\"modelica://HystFMU.Actuators.Hysteresis.KrasnoselskiiPokrovskii\">Actuators.Hysteresis.KrasnoselskiiPokrovskii</a>, <a href=\"modelica://HystFMU.Actuators.Hysteresis.PlayBankMlp\">Actuators.Hysteresis.PlayBankMlp</a>.</p>
</html>"));
end PrandtlIshlinskii;
