within HystFMU.Operators;
block PlayBank "Bank of play (backlash) operators"
  extends Interfaces.Sampled;
  parameter Integer n(min = 1) = 10 "Number of plays";
  parameter Real r[n](each min = 0) = fill(0.1, n) "Half-widths of the plays";
  parameter Real z0[n] = fill(0.0, n) "Initial play states";
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput z[n](start = z0, each fixed = true) "Plays" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
equation
  when sample(0, Ts) then
    z = Functions.play(u, r, pre(z));
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> z_i = max(u - r_i, min(u + r_i, z_i)).</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 3.</p>
<p><b>Limitations:</b> extrema between two samples are not seen.</p>
</html>"));
end PlayBank;
