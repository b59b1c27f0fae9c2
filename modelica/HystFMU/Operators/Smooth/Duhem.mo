within HystFMU.Operators.Smooth;
block Duhem "Duhem operator with polynomial slopes for rising and falling input, smooth"
  extends BaseClasses.Duhem(final usesRate = true);
  extends Interfaces.Rated;
protected
  Real w "State";
initial equation
  w = w0;
equation
  connect(du, rate);
  assert(abs(w0) <= w_max, "w0 must be within w_max, the bound of abs(w)");
  der(w) = noEvent(if rate > 0 then Functions.duhemSlope(u, w, a_rise, b_rise, c_rise, q)*rate else Functions.duhemSlope(u, w, a_fall, b_fall, c_fall, q)*rate);
  y = k*u + min(max(w, -w_max), w_max);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> dw/du = sum_i u<sup>i</sup> (a_i + sum_j (b_ij w<sup>j</sup> + c_ij abs(w) w<sup>j-1</sup>)), one set of coefficients for rising and one for falling u; y = k u + w.</p>
<p><b>Source:</b> Oh &amp; Bernstein, IEEE Trans. Autom. Control 50 (2005) 631-645; Coleman &amp; Hodgdon 1986 (Duhem's form).</p>
<p><b>Limitations:</b> An ordinary differential equation without events, driven by the rate of the input; no return-point memory, so no closed form from one reversal to the next and no realisation Events. The parameter du_max has no effect here.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.Duhem\">Operators.Sampled.Duhem</a>, <a href=\"modelica://HystFMU.Validation.Smooth.Duhem\">Validation.Smooth.Duhem</a>.</p>
</html>"));
end Duhem;
