within HystFMU.Functions;
function learn "Corrections of iterative learning control after a new error"
  extends Icons.Function;
  input Real e "Error of this step";
  input Real period[:] "Index of the last step (-1: none), its correction, corrections of one period, errors of this period";
  input Real gain "Learning gain";
  input Integer lead "Steps from a command to its effect";
  input Real smooth "Weight of each neighbour in the filter";
  output Real period_new[size(period, 1)] "Memory after this step";
protected
  Integer n = div(size(period, 1) - 2, 2);
  Integer now = integer(period[1]) + 1 "Index of this step, 0 to n - 1";
  Real w[div(size(period, 1) - 2, 2)] "Corrections";
algorithm
  period_new := period;
  if now == n then
    now := 0;
    // first assign the whole array: rumoca 0.10.2 loses elements that are assigned within an if
    w := zeros(n);
    for k in 1:n loop
      w[k] := period[2 + k] + gain*period[2 + n + mod(k - 1 + lead, n) + 1];
    end for;
    // the filter uses both neighbours, so it has no delay; indices are modulo n
    for k in 1:n loop
      period_new[2 + k] := smooth*(w[mod(k - 2, n) + 1] + w[mod(k, n) + 1]) + (1 - 2*smooth)*w[k];
    end for;
  end if;
  period_new[2 + n + now + 1] := e;
  period_new[1] := now;
  period_new[2] := period_new[2 + now + 1];
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> after the step n - 1: w_k &larr; Q (w_k + gain e_(k + lead)), Q w_k = smooth (w_(k-1) + w_(k+1)) + (1 - 2 smooth) w_k, with indices modulo n.</p>
<p><b>Source:</b> Bristow, Tharayil &amp; Alleyne, IEEE Control Systems 26 (2006) 96.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>learn(y_d - y, pre(period), gain, lead, smooth)</code> in <a href=\"modelica://HystFMU.Control.IterativeLearning\">Control.IterativeLearning</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.IterativeLearning\">Control.IterativeLearning</a>, which uses it.</p>
</html>"));
end learn;
