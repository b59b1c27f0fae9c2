within HystFMU.Functions;
function colemanHodgdon "State of the Coleman-Hodgdon operator after a new input"
  extends Icons.Function;
  input Real u "New input";
  input Real u_last "Last input";
  input Real w_last "State at the last input";
  input Real alpha "Rate of the exponential";
  input Real slope "k - b";
  output Real w "State at u, y - b u";
protected
  Real left = exp(-alpha*abs(u - u_last)) "Remaining share of the state";
algorithm
  w := w_last*left + (if u >= u_last then slope else -slope)*(1 - left)/alpha;
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> dw/du = (k - b) - alpha sgn(u') w, integrated from u_last to u.</p>
<p><b>Source:</b> Coleman &amp; Hodgdon 1986, with f(u) = b u and g(u) = k.</p>
<p><b>Limitations:</b> the input must not have a reversal between u_last and u.</p>
<p><b>Example:</b> <code>colemanHodgdon(u, pre(u_last), pre(w_last), alpha, k - b)</code> in <a href=\"modelica://HystFMU.Operators.Sampled.ColemanHodgdon\">Operators.Sampled.ColemanHodgdon</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Events.ColemanHodgdon\">Operators.Events.ColemanHodgdon</a>, <a href=\"modelica://HystFMU.Operators.Sampled.ColemanHodgdon\">Operators.Sampled.ColemanHodgdon</a>, <a href=\"modelica://HystFMU.Operators.Smooth.ColemanHodgdon\">Operators.Smooth.ColemanHodgdon</a>, which use it.</p>
</html>"));
end colemanHodgdon;
