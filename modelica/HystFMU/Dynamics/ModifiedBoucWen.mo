within HystFMU.Dynamics;
block ModifiedBoucWen "Modified Bouc-Wen model of a magnetorheological damper"
  extends BaseClasses.ModifiedBoucWen(y(start = c_1*alpha/(c_0 + c_1)*z0 - k_1*x_0, fixed = true));
  extends Interfaces.Sampled;
protected
  parameter Types.Position z_max = (A/(beta + gamma))^(1/n) "Bound of z";
  discrete Types.Position last(start = 0, fixed = true) "Displacement at the last sample";
  discrete Types.Velocity v(start = 0, fixed = true) "Velocity";
  discrete Real x[2](start = {0, max(-z_max, min(z_max, z0))}, each fixed = true) "Deflection of the operator, and z";
equation
  assert(beta + gamma > 0, "beta + gamma must be greater than 0");
  when sample(t0, Ts) then
    last = u;
    v = if pre(begun) then (u - pre(last))/Ts else 0;
    x = if pre(begun) then Functions.modifiedBoucWen(pre(x), v, Ts, {c_0, k_0, alpha}/(c_0 + c_1), A, beta/(beta + gamma), gamma/(beta + gamma), n, z_max) else pre(x);
    y = c_1/(c_0 + c_1)*(c_0*v + k_0*x[1] + alpha*x[2]) + k_1*(u - x_0);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> none.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.BaseClasses.ModifiedBoucWen\">Dynamics.BaseClasses.ModifiedBoucWen</a>: equation, source, example.</p>
</html>"));
end ModifiedBoucWen;
