within HystFMU.Functions;
function isNotDecreasing "True if no element is less than its predecessor"
  extends Icons.Function;
  input Real r[:] "Thresholds";
  output Boolean yes "True if the elements do not decrease";
protected
  Integer steps_down;
algorithm
  steps_down := 0;
  for i in 2:size(r, 1) loop
    if r[i] < r[i - 1] then
      steps_down := steps_down + 1;
    end if;
  end for;
  yes := steps_down == 0;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> r_i &ge; r_(i-1) for all i.</p>
<p><b>Source:</b> definition.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>isNotDecreasing(r)</code> in <a href=\"modelica://HystFMU.Inverse.Events.PrandtlIshlinskiiInverse\">Inverse.Events.PrandtlIshlinskiiInverse</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Events.PrandtlIshlinskiiInverse\">Inverse.Events.PrandtlIshlinskiiInverse</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.PrandtlIshlinskiiInverse\">Inverse.Sampled.PrandtlIshlinskiiInverse</a>, <a href=\"modelica://HystFMU.Operators.Events.PrandtlIshlinskii\">Operators.Events.PrandtlIshlinskii</a>, <a href=\"modelica://HystFMU.Operators.Sampled.PrandtlIshlinskii\">Operators.Sampled.PrandtlIshlinskii</a>, which use it.</p>
</html>"));
end isNotDecreasing;
