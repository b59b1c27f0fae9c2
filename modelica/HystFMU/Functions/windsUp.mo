within HystFMU.Functions;
function windsUp "True if a step of the integral moves the control further outside its limits"
  extends Icons.Function;
  input Real before "Unlimited control without the step";
  input Real after "Unlimited control with the step";
  input Real u_min "Lower limit";
  input Real u_max "Upper limit";
  output Boolean yes "True if the step must be omitted";
algorithm
  yes := after > u_max and after > before or after < u_min and after < before;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> (after &gt; u_max and after &gt; before) or (after &lt; u_min and after &lt; before).</p>
<p><b>Source:</b> conditional integration: Astrom &amp; Hagglund, PID Controllers, 2nd ed. 1995, section 3.5.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>windsUp(before, after, u_min, u_max)</code> in <a href=\"modelica://HystFMU.Control.SlidingMode\">Control.SlidingMode</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.Pid\">Control.Pid</a>, <a href=\"modelica://HystFMU.Control.SlidingMode\">Control.SlidingMode</a>, which use it.</p>
</html>"));
end windsUp;
