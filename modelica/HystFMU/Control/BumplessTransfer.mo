within HystFMU.Control;
block BumplessTransfer "Bumpless transfer: the output changes from the present command to a new one without a jump"
  extends BaseClasses.BumplessTransfer(u(start = 0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real share(start = 0, fixed = true) "Remaining share of the difference";
  discrete Real difference(start = 0, fixed = true) "u_present - u_c at the start of the transfer";
  discrete Real given(start = 0, fixed = true) "1 if u_present was given at the last step";
  discrete Real dt(unit = "s", start = 0, fixed = true) "Time since the last sample; 0 at the initialisation";
equation
  when sample(t0, Ts) then
    dt = if pre(begun) then Ts else 0;
    share = if abs(u_present) < 1e300 and pre(given) < 0.5 then 1 elseif dt < pre(share)*T then pre(share) - dt/T else 0;
    difference = if abs(u_present) < 1e300 and pre(given) < 0.5 then u_present - u_c else pre(difference);
    given = if abs(u_present) < 1e300 and dt > 0 then 1 else 0;
    u = if share > 0 then u_c + share*difference else u_c;
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> none.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.BaseClasses.BumplessTransfer\">Control.BaseClasses.BumplessTransfer</a>: equation, source, example.</p>
</html>"));
end BumplessTransfer;
