within HystFMU.Inverse.Events;
block ConstraintFactorInverse "Exact inverse of the constraint-factor operator, events at reversals"
  extends BaseClasses.ConstraintFactorInverse(final usesRate = true);
  extends Interfaces.Reversals(eps = 1e-9*Functions.constraintFactorBranch(min(1, d_max), a0, a, d_max));
protected
  discrete Real extrema[3 + 2*depth](start = cat(1, {0, 0, 0}, zeros(2*depth)), each fixed = true) "Dominant extrema of h";
  discrete Real x_turn(start = x0, fixed = true) "Output at the last reversal";
equation
  connect(dh, rate) annotation (Line(points = {{-110, -70}, {-80, -70}}, color = {0, 0, 127}));
  when {initial(), change(rising)} then
    extrema = Functions.turn(h, 0, pre(x_turn), pre(extrema));
    x_turn = Functions.constraintFactorInverse(h, Functions.branchOrigin(extrema, 0, x0, 2), a0, a, d_max);
  end when;
  x = Functions.constraintFactorInverse(h, Functions.branchOrigin(Functions.turn(h, 0, x_turn, extrema), 0, x0, 2), a0, a, d_max);
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> the branch must rise between 0 and d_max; only the unit checks this.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.BaseClasses.ConstraintFactorInverse\">Inverse.BaseClasses.ConstraintFactorInverse</a>: equation, source, example.</p>
</html>"));
end ConstraintFactorInverse;
