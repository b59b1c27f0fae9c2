within HystFMU.Functions;
function zhaoTanInverse "Branch of the inverse Zhao-Tan operator"
  extends Icons.Function;
  input Real h "Wanted output of the operator";
  input Real origin[3] "Start and scale of the branch, from branchOrigin";
  output Real x "Input of the operator";
protected
  Real v = origin[3]*abs(h - origin[1]);
  Real d "Solution of g(d) = v";
  Real e;
  Real g;
  Real dg;
  Real ddg;
algorithm
  d := v;
  if v > 0 and v < 50 then
    // the series at 0, or the asymptote, then Halley's method
    d := if v < 3 then sqrt(v) + v*(0.25 + sqrt(v)*7/96) else v + v*exp(-v);
    for i in 1:4 loop
      e := exp(-d);
      g := (1 - e)*d - v;
      dg := e*d + (1 - e);
      ddg := e*(2 - d);
      d := d - g*dg/(dg*dg - 0.5*g*ddg);
    end for;
  end if;
  x := origin[2] + (if h >= origin[1] then 1 else -1)*d/origin[3];
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> x = x_p + sgn(h - h_p) g<sup>-1</sup>(s abs(h - h_p))/s, g(d) = (1 - e<sup>-d</sup>) d.</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, section III; Halley's method.</p>
<p><b>Limitations:</b> none: four iterations give full accuracy for every v.</p>
<p><b>Example:</b> <code>zhaoTanInverse(h, Functions.branchOrigin(extrema, 0, x0, 2))</code> in <a href=\"modelica://HystFMU.Inverse.Events.ZhaoTanInverse\">Inverse.Events.ZhaoTanInverse</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Events.ZhaoTanInverse\">Inverse.Events.ZhaoTanInverse</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.ZhaoTanInverse\">Inverse.Sampled.ZhaoTanInverse</a>, which use it.</p>
</html>"));
end zhaoTanInverse;
