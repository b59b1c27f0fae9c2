within HystFMU.Operators.Events;
block ConstraintFactor "Constraint-factor operator (Ma): odd polynomial branch, events at reversals"
  extends BaseClasses.ConstraintFactor(final usesRate = true);
  extends Interfaces.Reversals;
protected
  parameter Boolean last = memory == Types.Memory.last "Only the last extremum is remembered";
  parameter Real virgin = if memory == Types.Memory.dominant then 2 else 1 "Scale of the virgin branch";
  discrete Real extrema[3 + 2*depth](start = cat(1, {0, 0, x0}, zeros(2*depth)), each fixed = true) "Extrema of x";
  discrete Real h_turn(start = 0, fixed = true) "Output at the last reversal";
  Real current[3 + 2*depth] "Extrema, those that x has passed wiped out";
equation
  connect(dx, rate);
  when {initial(), change(rising)} then
    extrema = Functions.turn(x, x0, pre(h_turn), pre(extrema), last);
    h_turn = Functions.constraintFactor(x, Functions.branchOrigin(extrema, x0, 0, virgin), a0, a, d_max);
  end when;
  current = Functions.turn(x, x0, h_turn, extrema, last);
  h = Functions.constraintFactor(x, Functions.branchOrigin(current, x0, 0, virgin), a0, a, d_max);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> h = h_p + sgn(x - x_p) g(d), g(d) = (1 - e<sup>-d</sup>) (a0 + sum_j a_j d<sup>2j-1</sup>), d = abs(x - x_p); virgin branch by Masing's rule.</p>
<p><b>Source:</b> Shen &amp; Ma 2017, eq. 1-2, with return-point memory.</p>
<p><b>Limitations:</b> One event for each reversal of the input, in between a closed form of the input: exact whatever the solver's step; the branch must not fall between 0 and d_max (the unit checks it); the time of a step grows with depth. A jump of the input must be a ramp, because the rate tells where it turns; only the sign of the rate is used.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.ConstraintFactor\">Operators.Sampled.ConstraintFactor</a>, <a href=\"modelica://HystFMU.Operators.Smooth.ConstraintFactor\">Operators.Smooth.ConstraintFactor</a>, <a href=\"modelica://HystFMU.Validation.Events.ConstraintFactor\">Validation.Events.ConstraintFactor</a>.</p>
</html>"));
end ConstraintFactor;
