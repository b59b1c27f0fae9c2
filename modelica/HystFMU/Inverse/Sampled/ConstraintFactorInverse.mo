within HystFMU.Inverse.Sampled;
block ConstraintFactorInverse "Exact inverse of the constraint-factor operator, sampled"
  extends BaseClasses.ConstraintFactorInverse(x(start = x0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real extrema[3 + 2*depth](start = cat(1, {0, 0, 0}, zeros(2*depth)), each fixed = true) "Dominant extrema of h";
equation
  when sample(0, Ts) then
    extrema = Functions.turn(h, 0, pre(x), pre(extrema));
    x = Functions.constraintFactorInverse(h, Functions.branchOrigin(extrema, 0, x0, 2), a0, a, d_max);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> x = x_p + sgn(h - h_p) g<sup>-1</sup>(abs(h - h_p)), g(d) = (1 - e<sup>-d</sup>) (a0 + sum_j a_j d<sup>2j-1</sup>).</p>
<p><b>Source:</b> Shen &amp; Ma 2017, eq. 1-2, solved for x; inverse by the same memory: Krejci &amp; Kuhnen 2001.</p>
<p><b>Limitations:</b> The branch must rise between 0 and d_max (the unit checks it). Extrema between two samples are not seen; the time of a step grows with depth.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.Cascade\">Examples.Cascade</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Events.ConstraintFactorInverse\">Inverse.Events.ConstraintFactorInverse</a>, <a href=\"modelica://HystFMU.Validation.Sampled.ConstraintFactorInverse\">Validation.Sampled.ConstraintFactorInverse</a>.</p>
</html>"));
end ConstraintFactorInverse;
