within HystFMU.Inverse.Events;
block ZhaoTanInverse "Exact inverse of the Zhao-Tan operator, events at reversals"
  extends BaseClasses.ZhaoTanInverse(final usesRate = true);
  extends Interfaces.Reversals;
protected
  discrete Real extrema[3 + 2*depth](start = cat(1, {0, 0, 0}, zeros(2*depth)), each fixed = true) "Dominant extrema of h";
  discrete Real x_turn(start = x0, fixed = true) "Output at the last reversal";
equation
  connect(dh, rate);
  when {initial(), change(rising)} then
    extrema = Functions.turn(h, 0, pre(x_turn), pre(extrema));
    x_turn = Functions.zhaoTanInverse(h, Functions.branchOrigin(extrema, 0, x0, 2));
  end when;
  x = Functions.zhaoTanInverse(h, Functions.branchOrigin(Functions.turn(h, 0, x_turn, extrema), 0, x0, 2));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> x = x_p + sgn(h - h_p) g<sup>-1</sup>(abs(h - h_p)), g(d) = (1 - e<sup>-d</sup>) d.</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, section III, solved for x; inverse by the same memory: Krejci &amp; Kuhnen 2001.</p>
<p><b>Limitations:</b> The inverse of memory = dominant. A branch begins with an infinite slope: right after a reversal, rounding of 1e-16 in h is 1e-8 in x. One event for each reversal; only the sign of the rate is used. The time of an evaluation grows with depth.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.Cascade\">Examples.Cascade</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Sampled.ZhaoTanInverse\">Inverse.Sampled.ZhaoTanInverse</a>, <a href=\"modelica://HystFMU.Validation.Events.ZhaoTanInverse\">Validation.Events.ZhaoTanInverse</a>.</p>
</html>"));
end ZhaoTanInverse;
