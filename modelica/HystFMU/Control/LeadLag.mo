within HystFMU.Control;
block LeadLag "Lead-lag controller with feed-forward and limits"
  extends BaseClasses.LeadLag(u(start = 0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real sections[2*n](each start = 0, each fixed = true) "Outputs of the lags, then inputs of the sections";
  discrete Real dt(unit = "s", start = 0, fixed = true) "Time since the last sample; 0 at the initialisation";
equation
  assert(u_min <= u_max, "u_min must not be greater than u_max");
  when sample(t0, Ts) then
    dt = if pre(begun) then Ts else 0;
    sections = Functions.leadLag(y_d - y, pre(sections), T_z, T_p, dt);
    u = min(max(u_ff + K*(sections[n] + T_z[n]/T_p[n]*sections[2*n]), u_min), u_max);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> the controller has no integral action; another block, such as a disturbance observer, must provide it. The initial state is in equilibrium with the first error.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.BaseClasses.LeadLag\">Control.BaseClasses.LeadLag</a>: equation, source, example.</p>
</html>"));
end LeadLag;
