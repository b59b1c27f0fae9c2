within HystFMU.Operators.Smooth;
block PrandtlIshlinskii "Prandtl-Ishlinskii operator: linear term plus weighted plays, smooth"
  extends BaseClasses.PrandtlIshlinskii(final usesRate = true);
  extends Interfaces.Rated;
  parameter Real width(min = 0) = 1e-3 "Input on which the corner of a play is rounded, greater than 0: the bound of the error of a play";
protected
  Real z[n] "Plays";
initial equation
  z = Functions.play(u, r, fill(u0, n));
equation
  connect(du, rate);
  for i in 1:n loop
    der(z[i]) = Functions.playRate(u, rate, r[i], z[i], width);
  end for;
  y = w0*u + w*z;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = w0 u + sum_i w_i p_{r_i}[u], p_r the play of half-width r, evaluated through the dominant extrema of u.</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001, eq. 5-10; Zhao &amp; Tan 2008, section II.</p>
<p><b>Limitations:</b> An ordinary differential equation without events, driven by the rate of the input; all plays start from u0; the time of a step grows with depth (16 is enough for most loops). A play lags behind the exact one by at most width. The parameter depth has no effect here.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.MinorLoops\">Examples.MinorLoops</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.PrandtlIshlinskii\">Operators.Sampled.PrandtlIshlinskii</a>, <a href=\"modelica://HystFMU.Operators.Events.PrandtlIshlinskii\">Operators.Events.PrandtlIshlinskii</a>, <a href=\"modelica://HystFMU.Validation.Smooth.PrandtlIshlinskii\">Validation.Smooth.PrandtlIshlinskii</a>.</p>
</html>"));
end PrandtlIshlinskii;
