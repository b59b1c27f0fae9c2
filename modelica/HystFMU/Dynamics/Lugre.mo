within HystFMU.Dynamics;
block Lugre "LuGre friction: bristles with a Stribeck curve"
  extends BaseClasses.Lugre(y(start = sigma_0*z0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Types.Position last(start = 0, fixed = true) "Displacement at the last sample";
  discrete Types.Velocity v(start = 0, fixed = true) "Velocity";
  discrete Types.Position d(start = d_s, fixed = true) "Deflection of steady motion";
  discrete Types.Position z(start = z0, fixed = true) "Deflection of the bristles";
equation
  when sample(t0, Ts) then
    last = u;
    v = if pre(begun) then (u - pre(last))/Ts else 0;
    d = d_c + (d_s - d_c)*exp(-(v/v_s)^2);
    z = if v > 0 then d + (pre(z) - d)*exp(-v*Ts/d) else -d + (pre(z) + d)*exp(v*Ts/d);
    y = sigma_0*z + sigma_1*(v - abs(v)*z/d) + sigma_2*v;
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> none.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.BaseClasses.Lugre\">Dynamics.BaseClasses.Lugre</a>: equation, source, example.</p>
</html>"));
end Lugre;
