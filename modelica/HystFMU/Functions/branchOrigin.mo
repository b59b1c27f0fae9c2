within HystFMU.Functions;
function branchOrigin "Where the current branch starts, and its scale"
  extends Icons.Function;
  input Real memory[:] "As left by turn";
  input Real x0 "Origin of the virgin branch";
  input Real h0 "Output there";
  input Real virgin = 2 "Scale of the virgin branch: 2 by Masing's rule";
  output Real origin[3] "Input and output at its start, scale s";
protected
  Integer depth = div(size(memory, 1) - 3, 2);
  Integer count = integer(memory[1]);
algorithm
  if count == 0 then
    origin := {x0, h0, virgin};
  else
    origin := {memory[3 + count], memory[3 + depth + count], 1};
  end if;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> h = h_p + sgn(x - x_p) g(s abs(x - x_p))/s with (x_p, h_p, s) from here and g the operator's branch; s = 1 after a
reversal, 2 on the virgin branch.</p>
<p><b>Source:</b> Masing's rule.</p>
<p><b>Smoothness:</b> the origin jumps where a loop closes; what is computed from it does not.</p>
<p><b>Limitation:</b> the memory must come from turn.</p>
<p><b>Example:</b> <code>branchOrigin(extrema, 0, x0, 2)</code> in <a href=\"modelica://HystFMU.Inverse.Events.ConstraintFactorInverse\">Inverse.Events.ConstraintFactorInverse</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Events.PrandtlIshlinskiiInverse\">Inverse.Events.PrandtlIshlinskiiInverse</a>, <a href=\"modelica://HystFMU.Inverse.Events.ZhaoTanInverse\">Inverse.Events.ZhaoTanInverse</a>, <a href=\"modelica://HystFMU.Inverse.Events.ZhaoTanInverseReconstructed\">Inverse.Events.ZhaoTanInverseReconstructed</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.PrandtlIshlinskiiInverse\">Inverse.Sampled.PrandtlIshlinskiiInverse</a>, which use it.</p>
</html>"));
end branchOrigin;
