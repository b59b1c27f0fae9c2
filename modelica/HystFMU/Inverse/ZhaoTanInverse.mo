within HystFMU.Inverse;
block ZhaoTanInverse "Exact inverse of the Zhao-Tan operator"
  extends Interfaces.Sampled;
  parameter Integer depth(min = 4) = 256 "Extrema that the memory holds";
  parameter Real x0 = 0 "Initial memory: the operator rests at x = x0, h = 0";
  Interfaces.RealInput h "Wanted output of the operator" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput x(start = x0, fixed = true) "Input of the operator that gives h" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  discrete Real extrema[3 + 2*depth](each start = 0, each fixed = true) "Dominant extrema of h";
equation
  when sample(0, Ts) then
    extrema = Functions.turn(h, 0, pre(x), pre(extrema));
    x = Functions.zhaoTanInverse(h, Functions.branchOrigin(extrema, 0, x0, 2));
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> x = x_p + sgn(h - h_p) g<sup>-1</sup>(abs(h - h_p)), g(d) = (1 - e<sup>-d</sup>) d.</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, section III, solved for x; inverse by the same memory: Krejci &amp; Kuhnen 2001.</p>
<p><b>Limitations:</b> the inverse of memory = dominant. The time of a step grows with depth.</p>
</html>"));
end ZhaoTanInverse;
