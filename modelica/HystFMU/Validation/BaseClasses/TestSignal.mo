within HystFMU.Validation.BaseClasses;
block TestSignal "Test signal of all operators"
  extends Icons.Source;
  parameter Real amplitude = 1 "Factor of the signal" annotation (Dialog(group = "Parameters"));
  parameter Real offset = 0 "Offset of the signal" annotation (Dialog(group = "Parameters"));
  Interfaces.RealOutput r "Signal" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  Interfaces.RealOutput dr(unit = "1/s") "Rate of r" annotation (Placement(transformation(extent = {{100, -80}, {120, -60}})));
protected
  constant Real pi = 3.141592653589793 "Number pi";
  constant Types.Time late = 1e-14 "Delay between an event and the start of its ramp";
equation
  // an event may be one rounding error late: a ramp that turns begins after the event, with r at its hold value;
  // events at the start of ramps: a solver that evaluates only rates would miss the ramp
  r = offset + amplitude*(
    if time < 0.2 then sin(20*pi*time)
    elseif time < 0.5 then 0.6*sin(20*pi*(time - 0.2)) + 0.35*sin(80*pi*(time - 0.2))
    elseif time < 0.8 then exp(-6*(time - 0.5))*sin(60*pi*(time - 0.5))
    elseif time < 0.85 then 14*(time - 0.8)
    elseif time < 0.9 then 0.7
    elseif time < 0.92 then 0.7 + 10*(time - 0.9)
    elseif time < 0.95 then 0.9
    elseif time < 1 then 0.9 - 14*noEvent(max(time - 0.95 - late, 0))
    elseif time < 1.001 then 0.2 - 1000*(time - 1)
    elseif time < 1.05 then -0.8
    elseif time < 1.051 then -0.8 + 1400*noEvent(max(time - 1.05 - late, 0))
    elseif time < 1.1 then 0.6
    else 0.6*cos(pi*(time - 1.1)/0.075) + 0.01*sin(240*pi*(time - 1.1)));
  dr = amplitude*(
    if time < 0.2 then 20*pi*cos(20*pi*time)
    elseif time < 0.5 then 12*pi*cos(20*pi*(time - 0.2)) + 28*pi*cos(80*pi*(time - 0.2))
    elseif time < 0.8 then exp(-6*(time - 0.5))*(60*pi*cos(60*pi*(time - 0.5)) - 6*sin(60*pi*(time - 0.5)))
    elseif time < 0.85 then 14
    elseif time < 0.9 then 0
    elseif time < 0.92 then 10
    elseif time < 0.95 then 0
    elseif time < 1 then -14
    elseif time < 1.001 then -1000
    elseif time < 1.05 then 0
    elseif time < 1.051 then 1400
    elseif time < 1.1 then 0
    else -8*pi*sin(pi*(time - 1.1)/0.075) + 2.4*pi*cos(240*pi*(time - 1.1)));
  annotation (Documentation(info = "<html>
<p>The signal consists of a sine; minor loops with two tones; a decaying sine; ramp, hold, second ramp, hold, ramp back; a step down and a step up; reversals with noise.</p>
<p><b>Equation:</b> see above; dr is the derivative of r.</p>
<p><b>Source:</b> chosen for this library.</p>
<p><b>Limitations:</b> valid from 0 to 1.4 s; a step has a rise time of 1 ms, because the rate of a jump is infinite.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Sampled.PlayBank\">Validation.Sampled.PlayBank</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.Sine\">Sources.Sine</a>.</p>
</html>"));
end TestSignal;
