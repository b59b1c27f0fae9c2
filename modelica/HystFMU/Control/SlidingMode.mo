within HystFMU.Control;
block SlidingMode "Sliding mode controller around a feed-forward, with integral action and anti-windup"
  extends Icons.Block;
  extends Interfaces.Sampled;
  parameter Real lam(unit = "1/s", min = 0) = 100 "Slope of the sliding line";
  parameter Real eta(unit = "s", min = 0) = 1e-3 "Linear gain of s";
  parameter Real rho(min = 0) = 0.01 "Switching gain";
  parameter Real epsilon(unit = "1/s", min = 0) = 1 "Width of the boundary layer";
  parameter Types.Switching switching = Types.Switching.smooth "s/(abs(s) + epsilon), or sat(s/epsilon)";
  parameter Real k_i(unit = "1/s2", min = 0) = 0 "Integral gain; 0: the law of the paper";
  parameter Real tau(unit = "s", min = 0) = 0 "Time constant of the filter of de/dt; 0: none";
  parameter Real u_min = -1e300 "Lower limit of u";
  parameter Real u_max = 1e300 "Upper limit of u";
  Interfaces.RealInput y_d "Reference" annotation (Placement(transformation(extent = {{-120, 50}, {-100, 70}})));
  Interfaces.RealInput y "Measured output of the plant" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput u_ff "Feed-forward: the inverse model" annotation (Placement(transformation(extent = {{-120, -70}, {-100, -50}})));
  Interfaces.RealOutput u(start = 0, fixed = true) "Control" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  Interfaces.RealOutput s(unit = "1/s", start = 0, fixed = true) "Distance from the sliding line" annotation (Placement(transformation(extent = {{100, -70}, {120, -50}})));
protected
  discrete Real integral(unit = "s", start = 0, fixed = true) "Integral of the error";
  discrete Real de(unit = "1/s", start = 0, fixed = true) "Filtered derivative of the error";
  discrete Real e(start = 0, fixed = true) "Error";
  discrete Real before(start = 0, fixed = true) "Unlimited control without the step of the integral";
  discrete Real after(start = 0, fixed = true) "Unlimited control with it";
  discrete Real dt(unit = "s", start = 0, fixed = true) "Time since the last sample; 0 at the initialisation";
equation
  assert(u_min <= u_max, "u_min must not be greater than u_max");
  when sample(0, Ts) then
    dt = if time < 0.5*Ts then 0 else Ts;
    e = y - y_d;
    de = if time < 0.5*Ts then 0 else (tau*pre(de) + (e - pre(e)))/(tau + Ts);
    before = Functions.slidingModeLaw(u_ff, de + lam*e + k_i*pre(integral), eta, rho, epsilon, switching == Types.Switching.saturation);
    after = Functions.slidingModeLaw(u_ff, de + lam*e + k_i*pre(integral) + k_i*(e*dt), eta, rho, epsilon, switching == Types.Switching.saturation);
    integral = if Functions.windsUp(before, after, u_min, u_max) then pre(integral) else pre(integral) + e*dt;
    s = de + lam*e + k_i*integral;
    u = min(max(Functions.slidingModeLaw(u_ff, s, eta, rho, epsilon, switching == Types.Switching.saturation), u_min), u_max);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> s = de/dt + lam e + k_i &int; e dt, e = y - y_d, u = u_ff - eta s - rho s/(abs(s) + epsilon), or with sat(s/epsilon).</p>
<p><b>Source:</b> Yu &amp; Alici 2005 (k_i = 0); integral sliding line: Slotine &amp; Li, Applied Nonlinear Control, sections 7.1 and 7.2.</p>
<p><b>Limitations:</b> de/dt is a backward difference: noise needs tau; eta &gt; 1 s with normalised signals is a limit cycle. The simulation must start at time 0.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.SlidingMode\">Examples.SlidingMode</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.Pid\">Control.Pid</a>, <a href=\"modelica://HystFMU.Control.Feedforward\">Control.Feedforward</a>.</p>
</html>"));
end SlidingMode;
