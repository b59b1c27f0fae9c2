within HystFMU.Inverse.Sampled;
block ConstraintFactorInverse "Exact inverse of the constraint-factor operator, sampled"
  extends BaseClasses.ConstraintFactorInverse(x(start = x0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real extrema[3 + 2*depth](start = cat(1, {0, 0, 0}, zeros(2*depth)), each fixed = true) "Dominant extrema of h";
equation
  when sample(t0, Ts) then
    extrema = Functions.turn(h, 0, pre(x), pre(extrema));
    x = Functions.constraintFactorInverse(h, Functions.branchOrigin(extrema, 0, x0, 2), a0, a, d_max);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> the branch must rise between 0 and d_max; only the unit checks this.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.BaseClasses.ConstraintFactorInverse\">Inverse.BaseClasses.ConstraintFactorInverse</a>: equation, source, example.</p>
</html>"));
end ConstraintFactorInverse;
