within HystFMU.Inverse.Sampled;
block ZhaoTanInverse "Exact inverse of the Zhao-Tan operator, sampled"
  extends BaseClasses.ZhaoTanInverse(x(start = x0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real extrema[3 + 2*depth](start = cat(1, {0, 0, 0}, zeros(2*depth)), each fixed = true) "Dominant extrema of h";
equation
  when sample(t0, Ts) then
    extrema = Functions.turn(h, 0, pre(x), pre(extrema));
    x = Functions.zhaoTanInverse(h, Functions.branchOrigin(extrema, 0, x0, 2));
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> only for memory = dominant. A branch begins with an infinite slope; after a reversal, a rounding error of 1e-16 in h causes an error of 1e-8 in x.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.BaseClasses.ZhaoTanInverse\">Inverse.BaseClasses.ZhaoTanInverse</a>: equation, source, example.</p>
</html>"));
end ZhaoTanInverse;
