within HystFMU.Control;
block SlidingMode "Sliding mode controller with feed-forward, integral action and anti-windup"
  extends BaseClasses.SlidingMode(u(start = 0, fixed = true), s(start = 0, fixed = true));
  extends Interfaces.Sampled;
protected
  parameter Real layer(unit = "1/s") = if epsilon > 0 then epsilon elseif rho > 0 then rho/(10*eta) else 1 "Width of the boundary layer";
  discrete Real integral(unit = "s", start = 0, fixed = true) "Integral of the error";
  discrete Real de(unit = "1/s", start = 0, fixed = true) "Filtered derivative of the error";
  discrete Real e(start = 0, fixed = true) "Error";
  discrete Real before(start = 0, fixed = true) "Unlimited control without the step of the integral";
  discrete Real after(start = 0, fixed = true) "Unlimited control with the step of the integral";
  discrete Real dt(unit = "s", start = 0, fixed = true) "Time since the last sample; 0 at the initialisation";
equation
  assert(u_min <= u_max, "u_min must not be greater than u_max");
  when sample(t0, Ts) then
    dt = if pre(begun) then Ts else 0;
    e = y - y_d;
    de = if pre(begun) then (tau*pre(de) + (e - pre(e)))/(tau + Ts) else 0;
    before = Functions.slidingModeLaw(u_ff, de + lam*e + k_i*pre(integral), eta, rho, layer, switching == Types.Switching.saturation);
    after = Functions.slidingModeLaw(u_ff, de + lam*e + k_i*pre(integral) + k_i*(e*dt), eta, rho, layer, switching == Types.Switching.saturation);
    integral = if Functions.windsUp(before, after, u_min, u_max) then pre(integral) else pre(integral) + e*dt;
    s = de + lam*e + k_i*integral;
    u = min(max(Functions.slidingModeLaw(u_ff, s, eta, rho, layer, switching == Types.Switching.saturation), u_min), u_max);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> de/dt is a backward difference, so measurements with noise need tau &gt; 0; with normalised signals, eta &gt; 1 s causes a limit cycle.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.BaseClasses.SlidingMode\">Control.BaseClasses.SlidingMode</a>: equation, source, example.</p>
</html>"));
end SlidingMode;
