within HystFMU.Functions;
function bend "Sum of one-sided dead zones"
  extends Icons.Function;
  input Real u "Input";
  input Real w0 "Slope at 0";
  input Real r[:] "Thresholds; the sign selects the side";
  input Real w[size(r, 1)] "Weights of the dead zones";
  output Real y "Output";
algorithm
  y := w0*u;
  for i in 1:size(r, 1) loop
    y := y + w[i]*(if r[i] > 0 then max(u - r[i], 0) elseif r[i] < 0 then min(u - r[i], 0) else u);
  end for;
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> w0 u + sum_i w_i S(u, r_i), S = max(u - r, 0) for r &gt; 0, min(u - r, 0) for r &lt; 0, u for r = 0.</p>
<p><b>Source:</b> Kuhnen, European Journal of Control 9 (2003) 407-418.</p>
<p><b>Limitations:</b> none. The function uses a scalar sum, because rumoca 0.10.2 copies arrays and would be much slower with w*deadZone(u, r).</p>
<p><b>Example:</b> <code>bend(p, b0, knots, b)</code> in <a href=\"modelica://HystFMU.Actuators.BaseClasses.Bent\">Actuators.BaseClasses.Bent</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.Hysteresis.BentPrandtlIshlinskii\">Actuators.Hysteresis.BentPrandtlIshlinskii</a>, which uses it.</p>
</html>"));
end bend;
