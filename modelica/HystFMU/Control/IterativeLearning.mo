within HystFMU.Control;
block IterativeLearning "Iterative learning control: corrections from the errors of earlier periods"
  extends BaseClasses.IterativeLearning(u(start = 0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real period[2 + 2*n](start = cat(1, {-1}, zeros(1 + 2*n)), each fixed = true) "Current step, its correction, corrections of one period, errors of this period";
equation
  assert(u_min <= u_max, "u_min must not be greater than u_max");
  when sample(t0, Ts) then
    period = Functions.learn(y_d - y, pre(period), gain, lead, smooth);
    u = min(max(u_ff + period[2], u_min), u_max);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> the period of the reference must be n Ts; errors that are not periodic are not learned; the computing time of a step is proportional to n.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.BaseClasses.IterativeLearning\">Control.BaseClasses.IterativeLearning</a>: equation, source, example.</p>
</html>"));
end IterativeLearning;
