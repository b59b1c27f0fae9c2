within HystFMU.Functions;
function lagOfInverse "First-order lags of the input of a creep, computed from its output"
  extends Icons.Function;
  input Real u "Output of the creep after the step";
  input Real w0 "Weight of the input of the creep";
  input Real w[:] "Weights of the lags of the creep";
  input Real T[size(w, 1)] "Time constants";
  input Real dt "Step";
  input Real q[size(w, 1)] "Last lags";
  output Real q_new[size(w, 1)] "New lags";
protected
  Real gain "Gain of the creep over the step";
  Real rest "Output of the creep minus the part of the lags";
  Real share "Relative change of a lag in the step";
algorithm
  gain := w0;
  rest := u;
  for i in 1:size(w, 1) loop
    share := 1 - exp(-dt/T[i]);
    gain := gain + w[i]*share;
    rest := rest - w[i]*(1 - share)*q[i];
  end for;
  q_new := lag(rest/gain, T, dt, q);
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> with s = 1 - e<sup>-dt/T</sup>: (w0 + w's) y = u - w'(1 - s) q, q+ = q + s (y - q).</p>
<p><b>Source:</b> exact discretisation of creep with a held input, solved for the input.</p>
<p><b>Limitations:</b> the gain w0 + w's must not be 0.</p>
<p><b>Example:</b> <code>lagOfInverse(u, w0, w, T, Ts, pre(q))</code> in <a href=\"modelica://HystFMU.Inverse.Sampled.CreepInverse\">Inverse.Sampled.CreepInverse</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Sampled.CreepInverse\">Inverse.Sampled.CreepInverse</a>, which uses it.</p>
</html>"));
end lagOfInverse;
