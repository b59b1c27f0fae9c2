within HystFMU.Inverse.Sampled;
block ZhaoTanInverseReconstructed "Inverse Zhao-Tan operator, reconstructed from the paper, sampled"
  extends BaseClasses.ZhaoTanInverseReconstructed(x(start = x0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real extrema[3 + 2*depth](start = cat(1, {0, 0, 0}, zeros(2*depth)), each fixed = true) "Dominant extrema of h";
equation
  when sample(t0, Ts) then
    extrema = Functions.turn(h, 0, pre(x), pre(extrema));
    x = Functions.zhaoTanInverseReconstructed(h, Functions.branchOrigin(extrema, 0, x0, 2));
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> the block is an approximation, which a network with the inputs (h, x) corrects. The exact inverse is ZhaoTanInverse.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.BaseClasses.ZhaoTanInverseReconstructed\">Inverse.BaseClasses.ZhaoTanInverseReconstructed</a>: equation, source, example.</p>
</html>"));
end ZhaoTanInverseReconstructed;
