within HystFMU.Functions;
function decayingSineWave "Decaying sine and its derivatives"
  extends Icons.Function;
  input Real t "Time";
  input Real frequency "Frequency";
  input Real phase "Phase";
  input Real decay "Rate of decay";
  output Real w[3] "Value, first and second derivative";
protected
  Real omega = 6.283185307179586*frequency;
  Real s = sin(6.283185307179586*frequency*t + phase);
  Real c = cos(6.283185307179586*frequency*t + phase);
  Real e = exp(-decay*t);
algorithm
  w[1] := e*s;
  w[2] := e*(omega*c - decay*s);
  w[3] := e*(-omega*omega*s - 2*decay*omega*c + decay*decay*s);
  annotation (smoothOrder = 2, Documentation(info = "<html>
<p><b>Equation:</b> e<sup>-decay t</sup> sin(2 pi f t + phase).</p>
<p><b>Source:</b> Zhao &amp; Tan 2008, section IV.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>decayingSineWave(time, frequency, phase, decay)</code> in <a href=\"modelica://HystFMU.Sources.DecayingSine\">Sources.DecayingSine</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.DecayingSine\">Sources.DecayingSine</a>, which uses it.</p>
</html>"));
end decayingSineWave;
