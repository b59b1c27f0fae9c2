within HystFMU.Control;
block SuperTwisting "Super-twisting sliding mode controller around a feed-forward, with anti-windup"
  extends Icons.Block;
  extends Interfaces.Sampled;
  parameter Real lam(unit = "1/s", min = 0) = 100 "Slope of the sliding line";
  parameter Real k_1(min = 0) = 0.01 "Gain of the root of s, in s^(1/2)";
  parameter Real k_2(unit = "1/s", min = 0) = 0.1 "Gain of the integrated switching";
  parameter Real mu(min = 0) = 0 "Share of the linear terms, in s^(1/2); 0: none";
  parameter Real epsilon(unit = "1/s", min = 0) = 1 "Width of the boundary layer";
  parameter Real tau(unit = "s", min = 0) = 0 "Time constant of the filter of de/dt; 0: none";
  parameter Real u_min = -1e300 "Lower limit of u";
  parameter Real u_max = 1e300 "Upper limit of u";
  Interfaces.RealInput y_d "Reference" annotation (Placement(transformation(extent = {{-120, 50}, {-100, 70}})));
  Interfaces.RealInput y "Measured output of the plant" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput u_ff "Feed-forward: the inverse model" annotation (Placement(transformation(extent = {{-120, -70}, {-100, -50}})));
  Interfaces.RealOutput u(start = 0, fixed = true) "Control" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  Interfaces.RealOutput s(unit = "1/s", start = 0, fixed = true) "Distance from the sliding line" annotation (Placement(transformation(extent = {{100, -70}, {120, -50}})));
protected
  discrete Real v(unit = "s", start = 0, fixed = true) "Integral of phi_2";
  discrete Real de(unit = "1/s", start = 0, fixed = true) "Filtered derivative of the error";
  discrete Real e(start = 0, fixed = true) "Error";
  discrete Real phi_1(start = 0, fixed = true) "Root of s, with the linear term";
  discrete Real phi_2(start = 0, fixed = true) "phi_1 times its derivative: the integrated switching";
  discrete Real before(start = 0, fixed = true) "Unlimited control without the step of the integral";
  discrete Real dt(unit = "s", start = 0, fixed = true) "Time since the last sample; 0 at the initialisation";
equation
  assert(u_min <= u_max, "u_min must not be greater than u_max");
  when sample(0, Ts) then
    dt = if time < 0.5*Ts then 0 else Ts;
    e = y - y_d;
    de = if time < 0.5*Ts then 0 else (tau*pre(de) + (e - pre(e)))/(tau + Ts);
    s = de + lam*e;
    phi_1 = s/sqrt(abs(s) + epsilon) + mu*s;
    phi_2 = 0.5*s/(abs(s) + epsilon) + 1.5*mu*s/sqrt(abs(s) + epsilon) + mu*mu*s;
    before = u_ff - k_1*phi_1 - k_2*pre(v);
    v = if Functions.windsUp(before, before - k_2*(phi_2*dt), u_min, u_max) then pre(v) else pre(v) + phi_2*dt;
    u = min(max(u_ff - k_1*phi_1 - k_2*v, u_min), u_max);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> s = de/dt + lam e, e = y - y_d; u = u_ff - k_1 phi_1 - k_2 v, v' = phi_2, phi_1 = abs(s)<sup>1/2</sup> sgn(s) + mu s,
phi_2 = sgn(s)/2 + 3/2 mu abs(s)<sup>1/2</sup> sgn(s) + mu<sup>2</sup> s; sgn(s) = s/(abs(s) + epsilon).</p>
<p><b>Source:</b> Levant, Int. J. Control 58 (1993) 1247; Moreno 2009, generalised super-twisting (linear terms).</p>
<p><b>Limitations:</b> the most accurate without delay and the most sensitive to one; de/dt is a backward difference: noise needs tau. The simulation must start at time 0.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.SuperTwisting\">Examples.SuperTwisting</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.SlidingMode\">Control.SlidingMode</a>, <a href=\"modelica://HystFMU.Validation.SuperTwisting\">Validation.SuperTwisting</a>.</p>
</html>"));
end SuperTwisting;
