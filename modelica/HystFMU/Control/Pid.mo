within HystFMU.Control;
block Pid "PID controller with feed-forward and anti-windup"
  extends BaseClasses.Pid(u(start = 0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real integral(unit = "s", start = 0, fixed = true) "Integral of the error";
  discrete Real de(unit = "1/s", start = 0, fixed = true) "Filtered derivative of the error";
  discrete Real e(start = 0, fixed = true) "Error";
  discrete Real before(start = 0, fixed = true) "Unlimited control without the step of the integral";
  discrete Real dt(unit = "s", start = 0, fixed = true) "Time since the last sample; 0 at the initialisation";
equation
  assert(u_min <= u_max, "u_min must not be greater than u_max");
  when sample(t0, Ts) then
    dt = if pre(begun) then Ts else 0;
    e = y_d - y;
    de = if pre(begun) then (tau*pre(de) + (e - pre(e)))/(tau + Ts) else 0;
    before = u_ff + Kp*e + Ki*pre(integral) + Kd*de;
    integral = if Functions.windsUp(before, before + Ki*(e*dt), u_min, u_max) then pre(integral) else pre(integral) + e*dt;
    u = min(max(u_ff + Kp*e + Ki*integral + Kd*de, u_min), u_max);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> de/dt is a backward difference, so measurements with noise need tau &gt; 0.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.BaseClasses.Pid\">Control.BaseClasses.Pid</a>: equation, source, example.</p>
</html>"));
end Pid;
