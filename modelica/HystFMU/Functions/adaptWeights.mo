within HystFMU.Functions;
function adaptWeights "Weights of an adaptive inverse and their covariance after a sample"
  extends Icons.Function;
  input Real phi[:] "Regressors";
  input Real e "Prediction error";
  input Real gate "1 if the sample updates the weights";
  input Real memory[:] "Number of sudden changes, consecutive wrong predictions, time since the last change, weights, rows of P up to the diagonal";
  input Real from[size(phi, 1)] "Weights at the start";
  input Real sd[size(phi, 1)] "Standard deviations after a sudden change";
  input Real sigma "Standard deviation of the prediction error";
  input Real q "Growth of P in a step, relative to sd^2";
  input Real change "Prediction error that indicates a sudden change";
  input Real pause "Shortest time between two sudden changes";
  input Real Ts "Sample period";
  input Real box "Largest deviation of a weight from its initial value, in sd";
  input Real w0_min "Lower limit of the weight of the linear term";
  output Real memory_new[size(memory, 1)] "Memory after the sample";
protected
  constant Integer in_a_row = 6 "Number of consecutive wrong predictions that indicate a sudden change";
  Integer m = size(phi, 1);
  Integer at = 3 + size(phi, 1) "Index in memory before the row of P";
  Real gain[size(phi, 1)] "P phi";
  Real leverage = 0 "phi' P phi";
  Real alpha "sigma^2 + phi' P phi";
  Real f "Factor of a row and column of P";
  Real fresh[div(size(phi, 1)*(size(phi, 1) + 1), 2)] "P after a sudden change";
  Real renew "1 if there is a sudden change";
algorithm
  memory_new := memory;
  gain := zeros(m);
  fresh := independent(sd);
  for i in 1:m loop
    for j in 1:i loop
      gain[i] := gain[i] + memory[at + j]*phi[j];
      gain[j] := gain[j] + (if j < i then memory[at + j]*phi[i] else 0);
    end for;
    at := at + i;
  end for;
  for i in 1:m loop
    leverage := leverage + gain[i]*phi[i];
  end for;
  alpha := leverage + max(sigma*sigma, 1e-10*leverage);
  at := 3 + m;
  for i in 1:m loop
    memory_new[3 + i] := memory[3 + i] + gate*gain[i]*(e/alpha);
    for j in 1:i loop
      memory_new[at + j] := memory[at + j] - gate*gain[i]*(gain[j]/alpha);
    end for;
    memory_new[at + i] := memory_new[at + i] + gate*q*sd[i]*sd[i];
    at := at + i;
  end for;
  for i in 1:m loop
    f := if memory_new[3 + m + div(i*(i + 1), 2)] > sd[i]*sd[i] then sqrt(sd[i]*sd[i]/memory_new[3 + m + div(i*(i + 1), 2)]) else 1;
    for j in 1:i - 1 loop
      memory_new[3 + m + div(i*(i - 1), 2) + j] := f*memory_new[3 + m + div(i*(i - 1), 2) + j];
    end for;
    for j in i + 1:m loop
      memory_new[3 + m + div(j*(j - 1), 2) + i] := f*memory_new[3 + m + div(j*(j - 1), 2) + i];
    end for;
    memory_new[3 + m + div(i*(i + 1), 2)] := min(memory_new[3 + m + div(i*(i + 1), 2)], sd[i]*sd[i]);
  end for;
  memory_new[3] := memory[3] + Ts;
  memory_new[2] := if gate < 0.5 then memory[2] elseif abs(e) > change and memory_new[3] >= pause then memory[2] + 1 else 0;
  renew := if gate > 0.5 and memory_new[2] > in_a_row - 0.5 then 1 else 0;
  for k in 1:div(m*(m + 1), 2) loop
    memory_new[3 + m + k] := if renew > 0.5 then fresh[k] else memory_new[3 + m + k];
  end for;
  memory_new[1] := memory[1] + renew;
  memory_new[2] := (1 - renew)*memory_new[2];
  memory_new[3] := (1 - renew)*memory_new[3];
  for i in 1:m loop
    memory_new[3 + i] := if gate > 0.5 then min(max(memory_new[3 + i], max(from[i] - box*sd[i], if i == 1 then w0_min else 0)), from[i] + box*sd[i]) else memory[3 + i];
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> theta += K e, P = P - K phi' P + q diag(sd^2), K = P phi/(sigma^2 + phi' P phi); no diagonal element of P above sd^2; P = diag(sd^2) after a sudden change.</p>
<p><b>Source:</b> Ljung &amp; Gunnarsson, Automatica 26 (1990) 7.</p>
<p><b>Limitations:</b> the regressors must be finite.</p>
<p><b>Example:</b> <code>adaptWeights(phi - low, y - y_low - (phi - low)*pre(theta), gate, pre(memory), cat(1, {w0}, w), sd, sigma, Ts/T, change, pause, Ts, box, w0_min)</code> in <a href=\"modelica://HystFMU.Inverse.AdaptiveInverse\">Inverse.AdaptiveInverse</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.AdaptiveInverse\">Inverse.AdaptiveInverse</a>, which uses it.</p>
</html>"));
end adaptWeights;
