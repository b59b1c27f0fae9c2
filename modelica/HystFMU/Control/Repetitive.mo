within HystFMU.Control;
block Repetitive "Repetitive control: corrects the reference by the errors of the last period"
  extends BaseClasses.Repetitive(r(start = 0, fixed = true));
  extends Interfaces.Sampled;
protected
  parameter Real zero_phase[2*n_q + 1] = {q[abs(j - n_q - 1) + 1] for j in 1:2*n_q + 1} "Taps of Q on both sides";
  parameter Real ahead_first[2*n_l + 1] = {l[2*n_l + 2 - j] for j in 1:2*n_l + 1} "Taps of L, from n_l steps ahead to n_l steps back";
  discrete Real w(start = 0, fixed = true) "Correction";
  discrete Real w_past[n + n_q](start = zeros(n + n_q), each fixed = true) "The last corrections, newest first";
  discrete Real e_past[n + n_l](start = zeros(n + n_l), each fixed = true) "The last errors, newest first";
equation
  assert(n_q < n and n_l < n, "n_q and n_l must be below n");
  when sample(t0, Ts) then
    w = zero_phase*pre(w_past[n - n_q:n + n_q]) + ahead_first*pre(e_past[n - n_l:n + n_l]);
    w_past = Functions.shift(w, pre(w_past));
    e_past = Functions.shift(if active > 0 then y_d - y else 0, pre(e_past));
    r = y_d + w;
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> the period of the reference must be n Ts; errors that are not periodic are not learned; the computing time of a step is proportional to n.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.BaseClasses.Repetitive\">Control.BaseClasses.Repetitive</a>: equation, source, example.</p>
</html>"));
end Repetitive;
