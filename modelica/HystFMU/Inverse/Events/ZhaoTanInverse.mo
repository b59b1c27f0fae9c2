within HystFMU.Inverse.Events;
block ZhaoTanInverse "Exact inverse of the Zhao-Tan operator, events at reversals"
  extends BaseClasses.ZhaoTanInverse(final usesRate = true);
  extends Interfaces.Reversals;
protected
  discrete Real extrema[3 + 2*depth](start = cat(1, {0, 0, 0}, zeros(2*depth)), each fixed = true) "Dominant extrema of h";
  discrete Real x_turn(start = x0, fixed = true) "Output at the last reversal";
equation
  connect(dh, rate) annotation (Line(points = {{-110, -70}, {-80, -70}}, color = {0, 0, 127}));
  when {initial(), change(rising)} then
    extrema = Functions.turn(h, 0, pre(x_turn), pre(extrema));
    x_turn = Functions.zhaoTanInverse(h, Functions.branchOrigin(extrema, 0, x0, 2));
  end when;
  x = Functions.zhaoTanInverse(h, Functions.branchOrigin(Functions.turn(h, 0, x_turn, extrema), 0, x0, 2));
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> only for memory = dominant. A branch begins with an infinite slope; after a reversal, a rounding error of 1e-16 in h causes an error of 1e-8 in x.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.BaseClasses.ZhaoTanInverse\">Inverse.BaseClasses.ZhaoTanInverse</a>: equation, source, example.</p>
</html>"));
end ZhaoTanInverse;
