within HystFMU.Functions;
function turn "Memory of dominant extrema after a new input"
  extends Icons.Function;
  input Real x "New input";
  input Real x0 "Origin of the virgin branch";
  input Real h "Output at the last input";
  input Real memory[:] "Number of extrema, direction, last input, extrema[depth], outputs at the extrema[depth]";
  input Boolean last = false "True: store only the last extremum, as the paper literally states";
  output Real memory_new[size(memory, 1)] "Memory after the new input";
protected
  Integer depth = div(size(memory, 1) - 3, 2);
  Integer count = integer(memory[1]);
  Real direction = memory[2];
  Integer pushed "1 if the last input was an extremum that is not yet in the list";
  Integer n;
  Boolean wiping;
algorithm
  memory_new := memory;
  // a plateau is not a reversal
  if x <> memory[3] then
    direction := if x > memory[3] then 1 else -1;
    pushed := if memory[2] <> 0 and direction <> memory[2] then 1 else 0;
    // wiping-out: x has passed the extremum before the newest one; later iterations remove two extrema
    wiping := not last;
    for i in 1:div(depth, 2) + 1 loop
      if wiping then
        n := count + pushed;
        if n == 0 then
          wiping := false;
        elseif n == 1 then
          // the outermost extremum also closes on the opposite virgin branch
          if direction*(x - x0) >= direction*(x0 - (if pushed == 1 then memory[3] else memory[4])) then
            count := 0;
            pushed := 0;
          end if;
          wiping := false;
        elseif direction > 0 and x < memory[2 + n] or direction < 0 and x > memory[2 + n] then
          wiping := false;
        else
          count := if pushed == 1 then count - 1 else count - 2;
          pushed := 0;
        end if;
      end if;
    end for;
    if pushed == 1 then
      // if the list is full, its smallest loop (the last pair) is deleted
      count := if last then 1 else (if count == depth then depth - 2 else count) + 1;
      memory_new[3 + count] := memory[3];
      memory_new[3 + depth + count] := h;
    end if;
    memory_new[1] := count;
    memory_new[2] := direction;
    memory_new[3] := x;
  end if;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> when x passes the extremum before the newest one, the loop is closed and both extrema are removed.
When x turns, the last input and its output are appended. The branch follows from the new memory, with the functions
branchOrigin and the branch function of the operator. With last = true, a new extremum always replaces the old one; then
the output drifts, and it is unbounded for random reversals.</p>
<p><b>Source:</b> Madelung's rules; Zhao &amp; Tan 2008, section III (dominant extrema), eq. 4 (literal reading).</p>
<p><b>Smoothness:</b> the list changes where a loop closes; the output of the operator does not jump.</p>
<p><b>Limitations:</b> depth (size of memory = 3 + 2 depth) must be at least 4. When the list is full, the smallest
stored loop (the last pair) is deleted. The computing time is proportional to depth: the loops have a fixed length,
because rumoca 0.10.2 supports no while loop whose end depends on data.</p>
<p><b>Example:</b> <code>turn(h, 0, pre(x), pre(extrema))</code> in <a href=\"modelica://HystFMU.Inverse.Sampled.ZhaoTanInverse\">Inverse.Sampled.ZhaoTanInverse</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Events.PrandtlIshlinskiiInverse\">Inverse.Events.PrandtlIshlinskiiInverse</a>, <a href=\"modelica://HystFMU.Inverse.Events.ZhaoTanInverse\">Inverse.Events.ZhaoTanInverse</a>, <a href=\"modelica://HystFMU.Inverse.Events.ZhaoTanInverseReconstructed\">Inverse.Events.ZhaoTanInverseReconstructed</a>, <a href=\"modelica://HystFMU.Inverse.Sampled.PrandtlIshlinskiiInverse\">Inverse.Sampled.PrandtlIshlinskiiInverse</a>, which use it.</p>
</html>"));
end turn;
