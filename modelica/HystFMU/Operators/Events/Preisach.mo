within HystFMU.Operators.Events;
block Preisach "Preisach operator in Everett's form, events at reversals"
  extends BaseClasses.Preisach(final usesRate = true);
  extends Interfaces.Reversals(eps = 1e-9*(hi - lo));
protected
  parameter Real origin = Functions.preisachOrigin(lo, hi, start) "Input at the start of the first branch";
  parameter Real virgin[2*n + 1] = Functions.virginBranch(n, E, offset, start) "First branch at half steps of the grid";
  discrete Real memory[3 + 2*depth](start = cat(1, {0, 0, origin}, zeros(2*depth)), each fixed = true) "Dominant extrema of u";
  discrete Real y_turn(start = Functions.firstBranch(origin, lo, hi, virgin), fixed = true) "Output at the last reversal";
equation
  connect(du, rate) annotation (Line(points = {{-110, -70}, {-80, -70}}, color = {0, 0, 127}));
  assert(lo < hi, "lo must be less than hi");
  when {initial(), change(rising)} then
    memory = Functions.turn(min(max(u, lo), hi), origin, pre(y_turn), pre(memory));
    y_turn = Functions.preisach(min(max(u, lo), hi), memory, lo, hi, n, E, virgin);
  end when;
  y = Functions.preisach(min(max(u, lo), hi), Functions.turn(min(max(u, lo), hi), origin, y_turn, memory), lo, hi, n, E, virgin);
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> outside [lo, hi] the output is constant. There is no realisation Smooth, because a relay has no smooth form with a bounded error.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.Preisach\">Operators.BaseClasses.Preisach</a>: equation, source, example.</p>
</html>"));
end Preisach;
