within HystFMU.Inverse.Sampled;
block ZhaoTanInverse "Exact inverse of the Zhao-Tan operator, sampled"
  extends BaseClasses.ZhaoTanInverse(x(start = x0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real extrema[3 + 2*depth](start = cat(1, {0, 0, 0}, zeros(2*depth)), each fixed = true) "Dominant extrema of h";
equation
  when sample(0, Ts) then
    extrema = Functions.turn(h, 0, pre(x), pre(extrema));
    x = Functions.zhaoTanInverse(h, Functions.branchOrigin(extrema, 0, x0, 2));
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> x = x_p + sgn(h - h_p) g<sup>-1</sup>(abs(h - h_p)), g(d) = (1 - e<sup>-d</sup>) d.</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, section III, solved for x; inverse by the same memory: Krejci &amp; Kuhnen 2001.</p>
<p><b>Limitations:</b> The inverse of memory = dominant. A branch begins with an infinite slope: right after a reversal, rounding of 1e-16 in h is 1e-8 in x. Extrema between two samples are not seen; the time of a step grows with depth.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.Cascade\">Examples.Cascade</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Events.ZhaoTanInverse\">Inverse.Events.ZhaoTanInverse</a>, <a href=\"modelica://HystFMU.Validation.Sampled.ZhaoTanInverse\">Validation.Sampled.ZhaoTanInverse</a>.</p>
</html>"));
end ZhaoTanInverse;
