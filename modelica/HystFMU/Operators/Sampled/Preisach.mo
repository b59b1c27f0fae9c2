within HystFMU.Operators.Sampled;
block Preisach "Preisach operator in Everett's form, sampled"
  extends BaseClasses.Preisach(y(start = Functions.firstBranch(origin, lo, hi, virgin), fixed = true));
  extends Interfaces.Sampled;
protected
  parameter Real origin = if start == Types.Magnetisation.low then lo elseif start == Types.Magnetisation.high then hi else 0.5*lo + 0.5*hi "Where the first branch starts";
  parameter Real virgin[2*n + 1] = if start == Types.Magnetisation.demagnetised then Functions.demagnetisedBranch(n, E, offset) else Functions.saturatedBranch(n, E, offset, start) "First branch at half steps of the grid";
  discrete Real memory[3 + 2*depth](start = cat(1, {0, 0, origin}, zeros(2*depth)), each fixed = true) "Dominant extrema of u";
equation
  assert(lo < hi, "lo must be less than hi");
  when sample(0, Ts) then
    memory = Functions.turn(min(max(u, lo), hi), origin, pre(y), pre(memory));
    y = Functions.preisach(min(max(u, lo), hi), memory, lo, hi, n, E, virgin);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = y_p - 2 E(u_p, u) falling, y_p + 2 E(u, u_p) rising; E linear between its grid values.</p>
<p><b>Source:</b> Mayergoyz, Mathematical Models of Hysteresis 1991, chapter 1; Everett 1955.</p>
<p><b>Limitations:</b> Acts at 0, Ts, 2 Ts, ...: the unit of the same name stepped with Ts; extrema between two samples are not seen; outside [lo, hi] nothing switches; no realisation Smooth: a relay has no smooth form of bounded error.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Events.Preisach\">Operators.Events.Preisach</a>, <a href=\"modelica://HystFMU.Validation.Sampled.Preisach\">Validation.Sampled.Preisach</a>.</p>
</html>"));
end Preisach;
