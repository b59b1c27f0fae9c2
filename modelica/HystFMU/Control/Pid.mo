within HystFMU.Control;
block Pid "PID controller with feed-forward and anti-windup"
  extends Icons.Block;
  extends Interfaces.Sampled;
  parameter Real Kp = 1 "Proportional gain";
  parameter Real Ki(unit = "1/s") = 0 "Integral gain";
  parameter Real Kd(unit = "s") = 0 "Derivative gain";
  parameter Real tau(unit = "s", min = 0) = 0 "Time constant of the derivative filter; 0: none";
  parameter Real u_min = -1e300 "Lower limit of u";
  parameter Real u_max = 1e300 "Upper limit of u";
  Interfaces.RealInput y_d "Reference" annotation (Placement(transformation(extent = {{-120, 50}, {-100, 70}})));
  Interfaces.RealInput y "Measured output of the plant" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput u_ff "Feed-forward" annotation (Placement(transformation(extent = {{-120, -70}, {-100, -50}})));
  Interfaces.RealOutput u(start = 0, fixed = true) "Control" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  discrete Real integral(unit = "s", start = 0, fixed = true) "Integral of the error";
  discrete Real de(unit = "1/s", start = 0, fixed = true) "Filtered derivative of the error";
  discrete Real e(start = 0, fixed = true) "Error";
  discrete Real before(start = 0, fixed = true) "Unlimited control without the step of the integral";
  discrete Real dt(unit = "s", start = 0, fixed = true) "Time since the last sample; 0 at the initialisation";
equation
  assert(u_min <= u_max, "u_min must not be greater than u_max");
  when sample(0, Ts) then
    dt = if time < 0.5*Ts then 0 else Ts;
    e = y_d - y;
    de = if time < 0.5*Ts then 0 else (tau*pre(de) + (e - pre(e)))/(tau + Ts);
    before = u_ff + Kp*e + Ki*pre(integral) + Kd*de;
    integral = if Functions.windsUp(before, before + Ki*(e*dt), u_min, u_max) then pre(integral) else pre(integral) + e*dt;
    u = min(max(u_ff + Kp*e + Ki*integral + Kd*de, u_min), u_max);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> u = u_ff + Kp e + Ki &int; e dt + Kd de/dt, e = y_d - y.</p>
<p><b>Source:</b> Astrom &amp; Hagglund, PID Controllers, 2nd ed. 1995, chapter 3.</p>
<p><b>Limitations:</b> de/dt is a backward difference: noise needs tau. The simulation must start at time 0.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.Pid\">Examples.Pid</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.SlidingMode\">Control.SlidingMode</a>, <a href=\"modelica://HystFMU.Control.Feedforward\">Control.Feedforward</a>.</p>
</html>"));
end Pid;
