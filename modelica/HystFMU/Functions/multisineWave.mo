within HystFMU.Functions;
function multisineWave "Sum of sines and its derivatives"
  extends Icons.Function;
  input Real t "Time";
  input Real f[:] "Frequencies";
  input Real a[size(f, 1)] "Amplitudes";
  input Real ph[size(f, 1)] "Phases";
  output Real w[3] "Value, first and second derivative";
protected
  Real omega;
algorithm
  w := zeros(3);
  for i in 1:size(f, 1) loop
    omega := 6.283185307179586*f[i];
    w[1] := w[1] + a[i]*sin(omega*t + ph[i]);
    w[2] := w[2] + a[i]*omega*cos(omega*t + ph[i]);
    w[3] := w[3] - a[i]*omega*omega*sin(omega*t + ph[i]);
  end for;
  annotation (smoothOrder = 2, Documentation(info = "<html>
<p><b>Equation:</b> sum_i a_i sin(2 pi f_i t + ph_i).</p>
<p><b>Source:</b> definition.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>multisineWave(time, f, a, ph)</code> in <a href=\"modelica://HystFMU.Sources.Multisine\">Sources.Multisine</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Sources.Multisine\">Sources.Multisine</a>, which uses it.</p>
</html>"));
end multisineWave;
