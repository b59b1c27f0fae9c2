within HystFMU.Functions;
function turnLast "Memory of the last extremum after a new input"
  extends Icons.Function;
  input Real x "New input";
  input Real h "Output at the previous input";
  input Real memory[:] "Count, direction, previous input, extrema[depth], outputs at them[depth]";
  output Real memory_new[size(memory, 1)] "Memory after the new input";
protected
  Integer depth = div(size(memory, 1) - 3, 2);
  Real direction;
algorithm
  memory_new := memory;
  if x <> memory[3] then
    direction := if x > memory[3] then 1 else -1;
    if memory[2] <> 0 and direction <> memory[2] then
      memory_new[1] := 1;
      memory_new[4] := memory[3];
      memory_new[4 + depth] := h;
    end if;
    memory_new[2] := direction;
    memory_new[3] := x;
  end if;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> when x turns, the previous input and the output there replace the remembered pair.</p>
<p><b>Source:</b> the literal reading of Zhao &amp; Tan 2008, eq. 4.</p>
<p><b>Limitation:</b> for replicas only: without wiping-out the operator drifts and is unbounded on random reversals.</p>
</html>"));
end turnLast;
