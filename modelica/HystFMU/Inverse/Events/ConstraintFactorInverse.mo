within HystFMU.Inverse.Events;
block ConstraintFactorInverse "Exact inverse of the constraint-factor operator, events at reversals"
  extends BaseClasses.ConstraintFactorInverse(final usesRate = true);
  extends Interfaces.Reversals;
protected
  discrete Real extrema[3 + 2*depth](start = cat(1, {0, 0, 0}, zeros(2*depth)), each fixed = true) "Dominant extrema of h";
  discrete Real x_turn(start = x0, fixed = true) "Output at the last reversal";
equation
  connect(dh, rate);
  when {initial(), change(rising)} then
    extrema = Functions.turn(h, 0, pre(x_turn), pre(extrema));
    x_turn = Functions.constraintFactorInverse(h, Functions.branchOrigin(extrema, 0, x0, 2), a0, a, d_max);
  end when;
  x = Functions.constraintFactorInverse(h, Functions.branchOrigin(Functions.turn(h, 0, x_turn, extrema), 0, x0, 2), a0, a, d_max);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> x = x_p + sgn(h - h_p) g<sup>-1</sup>(abs(h - h_p)), g(d) = (1 - e<sup>-d</sup>) (a0 + sum_j a_j d<sup>2j-1</sup>).</p>
<p><b>Source:</b> Shen &amp; Ma 2017, eq. 1-2, solved for x; inverse by the same memory: Krejci &amp; Kuhnen 2001.</p>
<p><b>Limitations:</b> The branch must rise between 0 and d_max (the unit checks it). One event for each reversal; only the sign of the rate is used. The time of an evaluation grows with depth.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.Cascade\">Examples.Cascade</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Sampled.ConstraintFactorInverse\">Inverse.Sampled.ConstraintFactorInverse</a>, <a href=\"modelica://HystFMU.Validation.Events.ConstraintFactorInverse\">Validation.Events.ConstraintFactorInverse</a>.</p>
</html>"));
end ConstraintFactorInverse;
