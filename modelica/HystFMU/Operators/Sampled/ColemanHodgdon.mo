within HystFMU.Operators.Sampled;
block ColemanHodgdon "Coleman-Hodgdon operator, sampled"
  extends BaseClasses.ColemanHodgdon(y(start = 0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real u_last(start = u0, fixed = true) "Input at the last sample";
  discrete Real w_last(start = y0 - b*u0, fixed = true) "y - b u at the last sample";
equation
  when sample(t0, Ts) then
    w_last = Functions.colemanHodgdon(u, pre(u_last), pre(w_last), alpha, k - b);
    u_last = u;
    y = b*u + w_last;
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> none.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.ColemanHodgdon\">Operators.BaseClasses.ColemanHodgdon</a>: equation, source, example.</p>
</html>"));
end ColemanHodgdon;
