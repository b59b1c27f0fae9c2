within HystFMU.Control;
block LeadLag "Lead-lag controller with feed-forward and limits"
  extends Icons.Block;
  extends Interfaces.Sampled;
  parameter Integer n(min = 1) = 1 "Number of sections";
  parameter Real K = 1 "Gain at rest";
  parameter Real T_z[n](each unit = "s", each min = 0) = fill(1.0, n) "Time constants of the zeros: lead above T_p";
  parameter Real T_p[n](each unit = "s", each min = 0) = fill(0.1, n) "Time constants of the poles";
  parameter Real u_min = -1e300 "Lower limit of u";
  parameter Real u_max = 1e300 "Upper limit of u";
  Interfaces.RealInput y_d "Reference" annotation (Placement(transformation(extent = {{-120, 50}, {-100, 70}})));
  Interfaces.RealInput y "Measured output of the plant" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput u_ff "Feed-forward" annotation (Placement(transformation(extent = {{-120, -70}, {-100, -50}})));
  Interfaces.RealOutput u(start = 0, fixed = true) "Control" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  discrete Real sections[2*n](each start = 0, each fixed = true) "Lagged parts of the sections, then their inputs";
  discrete Real dt(unit = "s", start = 0, fixed = true) "Time since the last sample; 0 at the initialisation";
equation
  assert(u_min <= u_max, "u_min must not be greater than u_max");
  when sample(0, Ts) then
    dt = if time < 0.5*Ts then 0 else Ts;
    sections = Functions.leadLag(y_d - y, pre(sections), T_z, T_p, dt);
    u = min(max(u_ff + K*(sections[n] + T_z[n]/T_p[n]*sections[2*n]), u_min), u_max);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> u = u_ff + K prod_i (T_z,i s + 1)/(T_p,i s + 1) e, e = y_d - y, s = 2/Ts (z - 1)/(z + 1).</p>
<p><b>Source:</b> Franklin, Powell &amp; Workman, Digital Control of Dynamic Systems, 3rd ed., sections 5.3 and 6.1.</p>
<p><b>Limitations:</b> no integral action: with a disturbance observer or alone it needs one elsewhere. It begins in equilibrium with the first error. The simulation must start at time 0.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.LeadLag\">Examples.LeadLag</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.Pid\">Control.Pid</a>, <a href=\"modelica://HystFMU.Control.DisturbanceObserver\">Control.DisturbanceObserver</a>, <a href=\"modelica://HystFMU.Validation.LeadLag\">Validation.LeadLag</a>.</p>
</html>"));
end LeadLag;
