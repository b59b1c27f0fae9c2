within HystFMU.Inverse.Sampled;
block ZhaoTanInverseReconstructed "Inverse Zhao-Tan operator, reconstructed from the paper, sampled"
  extends BaseClasses.ZhaoTanInverseReconstructed(x(start = x0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real extrema[3 + 2*depth](start = cat(1, {0, 0, 0}, zeros(2*depth)), each fixed = true) "Dominant extrema of h";
equation
  when sample(0, Ts) then
    extrema = Functions.turn(h, 0, pre(x), pre(extrema));
    x = Functions.zhaoTanInverseReconstructed(h, Functions.branchOrigin(extrema, 0, x0, 2));
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> x = x_p + sgn(h - h_p) (1 + e<sup>-d</sup>) d, d = abs(h - h_p); virgin branch by Masing's rule.</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, eq. 11 (lost; reconstructed).</p>
<p><b>Limitations:</b> An approximation that a network on (h, x) corrects; the exact inverse is ZhaoTanInverse. Extrema between two samples are not seen; the time of a step grows with depth.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.Cascade\">Examples.Cascade</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Events.ZhaoTanInverseReconstructed\">Inverse.Events.ZhaoTanInverseReconstructed</a>, <a href=\"modelica://HystFMU.Validation.Sampled.ZhaoTanInverseReconstructed\">Validation.Sampled.ZhaoTanInverseReconstructed</a>.</p>
</html>"));
end ZhaoTanInverseReconstructed;
