within HystFMU.Operators.Sampled;
block ConstraintFactor "Constraint-factor operator (Ma): odd polynomial branch, sampled"
  extends BaseClasses.ConstraintFactor(h(start = 0, fixed = true));
  extends Interfaces.Sampled;
protected
  parameter Boolean last = memory == Types.Memory.last "True if only the last extremum is stored";
  parameter Real virgin = if memory == Types.Memory.dominant then 2 else 1 "Scale of the virgin branch";
  discrete Real extrema[3 + 2*depth](start = cat(1, {0, 0, x0}, zeros(2*depth)), each fixed = true) "Extrema of x";
equation
  when sample(t0, Ts) then
    extrema = Functions.turn(x, x0, pre(h), pre(extrema), last);
    h = Functions.constraintFactor(x, Functions.branchOrigin(extrema, x0, 0, virgin), a0, a, d_max);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> the branch must not fall between 0 and d_max; only the unit checks this. The computing time of a step is proportional to depth.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.ConstraintFactor\">Operators.BaseClasses.ConstraintFactor</a>: equation, source, example.</p>
</html>"));
end ConstraintFactor;
