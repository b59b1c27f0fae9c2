within HystFMU.Operators.Sampled;
block ConstraintFactor "Constraint-factor operator (Ma): odd polynomial branch, sampled"
  extends BaseClasses.ConstraintFactor(h(start = 0, fixed = true));
  extends Interfaces.Sampled;
protected
  parameter Boolean last = memory == Types.Memory.last "Only the last extremum is remembered";
  parameter Real virgin = if memory == Types.Memory.dominant then 2 else 1 "Scale of the virgin branch";
  discrete Real extrema[3 + 2*depth](start = cat(1, {0, 0, x0}, zeros(2*depth)), each fixed = true) "Extrema of x";
equation
  when sample(0, Ts) then
    extrema = Functions.turn(x, x0, pre(h), pre(extrema), last);
    h = Functions.constraintFactor(x, Functions.branchOrigin(extrema, x0, 0, virgin), a0, a, d_max);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> h = h_p + sgn(x - x_p) g(d), g(d) = (1 - e<sup>-d</sup>) (a0 + sum_j a_j d<sup>2j-1</sup>), d = abs(x - x_p); virgin branch by Masing's rule.</p>
<p><b>Source:</b> Shen &amp; Ma 2017, eq. 1-2, with return-point memory.</p>
<p><b>Limitations:</b> Acts at 0, Ts, 2 Ts, ...: the unit of the same name stepped with Ts; extrema between two samples are not seen; the branch must not fall between 0 and d_max (the unit checks it); the time of a step grows with depth.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Events.ConstraintFactor\">Operators.Events.ConstraintFactor</a>, <a href=\"modelica://HystFMU.Operators.Smooth.ConstraintFactor\">Operators.Smooth.ConstraintFactor</a>, <a href=\"modelica://HystFMU.Validation.Sampled.ConstraintFactor\">Validation.Sampled.ConstraintFactor</a>.</p>
</html>"));
end ConstraintFactor;
