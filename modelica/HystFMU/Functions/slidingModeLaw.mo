within HystFMU.Functions;
function slidingModeLaw "Control law of the sliding mode controller, without limits"
  extends Icons.Function;
  input Real u_ff "Feed-forward";
  input Real s "Distance from the sliding line";
  input Real eta "Linear gain";
  input Real rho "Switching gain";
  input Real epsilon "Width of the boundary layer";
  input Boolean saturation "True: linear within the boundary layer, constant outside";
  output Real u "Control";
algorithm
  u := u_ff - eta*s - rho*(if saturation then min(max(s/epsilon, -1), 1) else s/(abs(s) + epsilon));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> u = u_ff - eta s - rho s/(abs(s) + epsilon), or with sat(s/epsilon).</p>
<p><b>Source:</b> Yu &amp; Alici 2005; Slotine &amp; Li, Applied Nonlinear Control, section 7.2.</p>
<p><b>Limitations:</b> epsilon &gt; 0.</p>
<p><b>Example:</b> <code>slidingModeLaw(u_ff, de + lam*e + k_i*pre(integral), eta, rho, layer, switching == Types.Switching.saturation)</code> in <a href=\"modelica://HystFMU.Control.SlidingMode\">Control.SlidingMode</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.SlidingMode\">Control.SlidingMode</a>, which uses it.</p>
</html>"));
end slidingModeLaw;
