within HystFMU.Actuators.Hysteresis;
model KrasnoselskiiPokrovskii "Weighted kernels between two ramps; passive if no weight is negative"
  extends BaseClasses.Hysteresis(final instantaneous = passive, final passive = scale > 0 and min(w) >= 0, final y_start = offset + scale*w*Functions.kernelStart(n, lo, hi, x_start));
  extends Icons.Smooth;
  parameter Integer n(min = 1) = 4 "Number of grid points" annotation (Dialog(group = "Sizes"));
  parameter Real lo = -1 "Lowest scaled voltage" annotation (Dialog(group = "Limits"));
  parameter Real hi = 1 "Highest scaled voltage" annotation (Dialog(group = "Limits"));
  parameter Real w[div(n*(n + 1), 2)] = fill(0.1, div(n*(n + 1), 2)) "Weights of the kernels" annotation (Dialog(group = "Parameters"));
  parameter Real width(min = 0) = 1e-3 "Width of the rounded corner of a kernel, greater than 0" annotation (Dialog(tab = "Advanced"));
protected
  parameter Integer m = div(n*(n + 1), 2) "Number of kernels";
  parameter Real a = (hi - lo)/n "Rise length of the ridge function";
  parameter Real p1[m] = Functions.kernelGrid(n, lo, hi, false) "Inputs at which the falling ramps reach -1";
  parameter Real p2[m] = Functions.kernelGrid(n, lo, hi, true) "Inputs at which the rising ramps leave -1";
  Real k[m] "Kernels";
  Real dk[m](each unit = "1/s") "Rates of k";
initial equation
  k = Functions.kernel(x, a, p1, p2, Functions.kernelStart(n, lo, hi, x_start));
equation
  assert(lo < hi, "lo must be less than hi");
  for i in 1:m loop
    dk[i] = Functions.kernelRate(x, dx, a, p1[i], p2[i], k[i], width);
    der(k[i]) = dk[i];
  end for;
  s = w*k;
  ds = w*dk;
  y_rest = y_start;
  kept = sum(w[i]*(0.25*a*(k[i] + 1)^2 + 0.5*(p1[i] + p2[i])*k[i]) for i in 1:m);
  lost = sum(w[i]*(x - 0.5*a*(k[i] + 1) - 0.5*(p1[i] + p2[i]))*dk[i] for i in 1:m);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> s = sum_i w_i k_i[x]; in kept and lost, the reversible voltage of a kernel is the middle of its two ramps, a (k_i + 1)/2 + (p1_i + p2_i)/2.</p>
<p><b>Heat:</b> heat &ge; 0 at every instant if no weight is negative. Otherwise passivity is not proven: a closed cycle may generate energy.</p>
<p><b>Source:</b> Banks, Kurdila &amp; Webb 1997; Zhao &amp; Tan 2008, section V.</p>
<p><b>Limitations:</b> lo must be less than hi; a kernel differs from the exact kernel by at most width; outside [lo, hi] the output is constant.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.StackMovesMass\">Examples.StackMovesMass</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.BaseClasses.Hysteresis\">Actuators.BaseClasses.Hysteresis</a>, <a href=\"modelica://HystFMU.Operators.Smooth.KrasnoselskiiPokrovskii\">Operators.Smooth.KrasnoselskiiPokrovskii</a>, <a href=\"modelica://HystFMU.Actuators.Hysteresis.PrandtlIshlinskii\">Actuators.Hysteresis.PrandtlIshlinskii</a>, <a href=\"modelica://HystFMU.Actuators.Hysteresis.BentPrandtlIshlinskii\">Actuators.Hysteresis.BentPrandtlIshlinskii</a>, <a href=\"modelica://HystFMU.Actuators.Hysteresis.Preisach\">Actuators.Hysteresis.Preisach</a>, <a href=\"modelica://HystFMU.Actuators.Hysteresis.PlayBankMlp\">Actuators.Hysteresis.PlayBankMlp</a>.</p>
</html>"));
end KrasnoselskiiPokrovskii;
