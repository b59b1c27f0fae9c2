within HystFMU.Functions;
function branchOrigin "Start and scale of the current branch"
  extends Icons.Function;
  input Real memory[:] "Memory from the function turn";
  input Real x0 "Origin of the virgin branch";
  input Real h0 "Output at x0";
  input Real virgin = 2 "Scale of the virgin branch: 2 by Masing's rule";
  output Real origin[3] "Input and output at the start of the branch, scale s";
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
<p><b>Equation:</b> h = h_p + sgn(x - x_p) g(s abs(x - x_p))/s with (x_p, h_p, s) from this function and the branch g of
the operator; s = 1 after a reversal, 2 on the virgin branch.</p>
<p><b>Source:</b> Masing's rule.</p>
<p><b>Smoothness:</b> the origin jumps where a loop closes; the output of the operator does not jump.</p>
<p><b>Limitation:</b> the memory must be a result of the function turn.</p>
<p><b>Example:</b> <code>branchOrigin(extrema, 0, x0, 2)</code> in <a href=\"modelica://HystFMU.Inverse.Events.ConstraintFactorInverse\">Inverse.Events.ConstraintFactorInverse</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Events.PrandtlIshlinskiiInverse\">Inverse.Events.PrandtlIshlinskiiInverse</a>, <a href=\"modelica://HystFMU.Inverse.Events.ZhaoTanInverse\">Inverse.Events.ZhaoTanInverse</a>, <a href=\"modelica://HystFMU.Inverse.Events.ZhaoTanInverseReconstructed\">Inverse.Events.ZhaoTanInverseReconstructed</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.PrandtlIshlinskiiInverse\">Inverse.Sampled.PrandtlIshlinskiiInverse</a>, which use it.</p>
</html>"));
end branchOrigin;
