within HystFMU.Plants;
block BacklashSum "Weighted sum of backlash (play) operators, plain states"
  extends Interfaces.Sampled;
  parameter Integer n(min = 1) = 10 "Number of backlash operators";
  parameter Real w0 = 0 "Weight of the linear term";
  parameter Real r[n](each min = 0) = fill(0.1, n) "Half-widths of the plays";
  parameter Real w[n] = fill(0.1, n) "Weights of the plays";
  parameter Real z0[n] = fill(0.0, n) "Initial play states";
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y(start = w*z0, fixed = true) "Output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  discrete Real z[n](start = z0, each fixed = true) "Play states";
equation
  when sample(0, Ts) then
    z = Functions.play(u, r, pre(z));
    y = w0*u + w*z;
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> z_i = max(u - r_i, min(u + r_i, z_i)), y = w0 u + sum_i w_i z_i.</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, section II; Krejci &amp; Kuhnen 2001, eq. 3.</p>
<p><b>Limitations:</b> extrema between two samples are not seen.</p>
</html>"));
end BacklashSum;
