within HystFMU.Control;
block SuperTwisting "Super-twisting sliding mode controller with feed-forward and anti-windup"
  extends BaseClasses.SuperTwisting(u(start = 0, fixed = true), s(start = 0, fixed = true));
  extends Interfaces.Sampled;
protected
  parameter Real layer(unit = "1/s") = if epsilon > 0 then epsilon elseif k_1 <= 0 and k_2 <= 0 then 1 else (10*k_2/(lam*k_1))^2 "Width of the boundary layer";
  discrete Real v(unit = "s", start = 0, fixed = true) "Integral of the switching term";
  discrete Real de(unit = "1/s", start = 0, fixed = true) "Filtered derivative of the error";
  discrete Real e(start = 0, fixed = true) "Error";
  discrete Real phi_1(start = 0, fixed = true) "Square root of s plus the linear term";
  discrete Real phi_2(start = 0, fixed = true) "Integrated switching term: phi_1 times the derivative of phi_1";
  discrete Real before(start = 0, fixed = true) "Unlimited control without the step of the integral";
  discrete Real dt(unit = "s", start = 0, fixed = true) "Time since the last sample; 0 at the initialisation";
equation
  assert(u_min <= u_max, "u_min must not be greater than u_max");
  when sample(t0, Ts) then
    dt = if pre(begun) then Ts else 0;
    e = y - y_d;
    de = if pre(begun) then (tau*pre(de) + (e - pre(e)))/(tau + Ts) else 0;
    s = de + lam*e;
    phi_1 = s/sqrt(abs(s) + layer) + mu*s;
    phi_2 = 0.5*s/(abs(s) + layer) + 1.5*mu*s/sqrt(abs(s) + layer) + mu*mu*s;
    before = u_ff - k_1*phi_1 - k_2*pre(v);
    v = if Functions.windsUp(before, before - k_2*(phi_2*dt), u_min, u_max) then pre(v) else pre(v) + phi_2*dt;
    u = min(max(u_ff - k_1*phi_1 - k_2*v, u_min), u_max);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> this controller is the most accurate one without delay, and the most sensitive one to delay; de/dt is a backward difference, so measurements with noise need tau &gt; 0.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.BaseClasses.SuperTwisting\">Control.BaseClasses.SuperTwisting</a>: equation, source, example.</p>
</html>"));
end SuperTwisting;
