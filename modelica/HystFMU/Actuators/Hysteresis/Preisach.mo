within HystFMU.Actuators.Hysteresis;
model Preisach "Preisach operator in Everett's form, events at reversals; passive if the density is not negative"
  extends BaseClasses.Parallel(final passive = scale > 0 and Functions.everettLeastDensity(n, E) >= 0 and passiveBeside, final p_start = Functions.firstBranch(min(max(x_start, lo), hi), lo, hi, virgin));
  extends Interfaces.Reversals(eps = 1e-9*(hi - lo));
  parameter Integer n(min = 1) = 2 "Number of grid steps over [lo, hi]" annotation (Dialog(group = "Sizes"));
  parameter Integer depth(min = 4) = 16 "Maximum number of stored extrema" annotation (Dialog(group = "Memory"));
  parameter Real lo = -1 "Scaled voltage of negative saturation" annotation (Dialog(group = "Limits"));
  parameter Real hi = 1 "Scaled voltage of positive saturation" annotation (Dialog(group = "Limits"));
  parameter Real E[div(n*(n + 1), 2)] = {0.2, 0.6, 0.2} "Everett function at (alpha_1, beta_0), (alpha_2, beta_0), (alpha_2, beta_1), .., (alpha_n, beta_(n-1))" annotation (Dialog(group = "Parameters"));
  parameter Types.Magnetisation start = Types.Magnetisation.demagnetised "Initial memory" annotation (Dialog(group = "Start"));
protected
  parameter Real origin = Functions.preisachOrigin(lo, hi, start) "Input at the start of the first branch";
  parameter Real virgin[2*n + 1] = Functions.virginBranch(n, E, 0, start) "First branch at half steps of the grid";
  discrete Real memory[3 + 2*depth](start = cat(1, {0, 0, origin}, zeros(2*depth)), each fixed = true) "Dominant extrema of x";
  discrete Real p_turn(start = Functions.firstBranch(origin, lo, hi, virgin), fixed = true) "Output at the last reversal";
  Real bounded "x, limited to [lo, hi]";
initial equation
  // uses parameters, not bent: in rumoca 0.10.2, initial values must not depend on a discrete variable
  l = fill(Functions.bend(p_start, b0, knots, b), lags);
equation
  assert(lo < hi, "lo must be less than hi");
  rate = dx;
  bounded = min(max(x, lo), hi);
  when {initial(), change(rising)} then
    memory = Functions.turn(bounded, origin, pre(p_turn), pre(memory));
    p_turn = Functions.preisach(bounded, memory, lo, hi, n, E, virgin);
  end when;
  // the memory before this event: the new memory would depend on the rate, which depends on dp below
  p = Functions.preisach(bounded, Functions.turn(bounded, origin, pre(p_turn), pre(memory)), lo, hi, n, E, virgin);
  dp = noEvent(if x > lo and x < hi then Functions.preisachSlope(bounded, Functions.turn(bounded, origin, pre(p_turn), pre(memory)), lo, hi, n, E, virgin)*dx else 0);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> p = p_t - 2 E(x_t, x) falling, p_t + 2 E(x, x_t) rising, E linear between its grid values; BaseClasses.Parallel computes s from p.</p>
<p><b>Heat:</b> heat is the whole power; its sign changes within a cycle. Its mean over each closed cycle is &ge; 0 under these conditions: the density is not negative, static nonlinearity and curve rise, lags have positive weights, and there is no creep and no nonlinear lag. Otherwise passivity is not proven.</p>
<p><b>Source:</b> Mayergoyz, Mathematical Models of Hysteresis 1991, chapter 1.</p>
<p><b>Limitations:</b> outside [lo, hi] the output of the operator is constant; the parameter start, not u_start, sets the initial memory; rumoca 0.10.2 misses two reversals within one output interval.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.StackMovesMass\">Examples.StackMovesMass</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.BaseClasses.Hysteresis\">Actuators.BaseClasses.Hysteresis</a>, <a href=\"modelica://HystFMU.Operators.Events.Preisach\">Operators.Events.Preisach</a>, <a href=\"modelica://HystFMU.Actuators.Hysteresis.PrandtlIshlinskii\">Actuators.Hysteresis.PrandtlIshlinskii</a>, <a href=\"modelica://HystFMU.Actuators.Hysteresis.BentPrandtlIshlinskii\">Actuators.Hysteresis.BentPrandtlIshlinskii</a>, <a href=\"modelica://HystFMU.Actuators.Hysteresis.KrasnoselskiiPokrovskii\">Actuators.Hysteresis.KrasnoselskiiPokrovskii</a>, <a href=\"modelica://HystFMU.Actuators.Hysteresis.PlayBankMlp\">Actuators.Hysteresis.PlayBankMlp</a>.</p>
</html>"));
end Preisach;
