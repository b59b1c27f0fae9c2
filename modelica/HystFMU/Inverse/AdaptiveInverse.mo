within HystFMU.Inverse;
block AdaptiveInverse "Adaptive inverse of a Prandtl-Ishlinskii operator: learns its weights during operation"
  extends BaseClasses.AdaptiveInverse(u(start = u0, fixed = true), theta(start = cat(1, {w0}, w), each fixed = true), y_hat(start = (w0 + sum(w))*u0, fixed = true), gate(start = 0, fixed = true), changes(start = 0, fixed = true));
  extends Interfaces.Sampled;
protected
  constant Real pi = 3.141592653589793 "Number pi";
  parameter Real F[3, 3] = if f_n > 0 then Functions.observedStep(2*pi*f_n*Ts, zeta) else [0, 0, 1; 0, 0, 0; 0, 0, 1] "Transition matrix of position, velocity/omega_n and input of G0";
  parameter Integer m = n + 1 "Number of weights";
  discrete Real z[n](each start = u0, each fixed = true) "Plays of the command";
  discrete Real z_then[n](each start = u0, each fixed = true) "Plays of the delayed command";
  discrete Real past[delay + 1](each start = u0, each fixed = true) "Last commands, newest first";
  discrete Real phi[n + 1](each start = u0, each fixed = true) "Regressors";
  discrete Real dphi[n + 1](each start = 0, each fixed = true) "Rates of the regressors/omega_n";
  parameter Real slow = 1 - exp(-2*pi*f_h*Ts) "Gain of the low pass in a step";
  discrete Real low[n + 1](each start = if f_h > 0 then u0 else 0, each fixed = true) "Slow part of the regressors";
  discrete Real y_low(start = 0, fixed = true) "Slow part of the measured output";
  discrete Real memory[3 + m + div(m*(m + 1), 2)](start = cat(1, {0, 0, pause, w0}, w, Functions.independent(start*sd)), each fixed = true) "Number of sudden changes, consecutive wrong predictions, time since the last change, weights, P";
  discrete Real y_d_last(start = 0, fixed = true) "Reference of the last sample";
equation
  assert(Functions.isNotDecreasing(r), "the thresholds r must not decrease");
  assert(w0_min <= w0, "w0_min must not be greater than w0");
  assert(u_min <= u_max, "u_min must not be greater than u_max");
  when sample(t0, Ts) then
    z_then = Functions.play(pre(past[delay + 1]), r, pre(z_then));
    phi = F[1, 1]*pre(phi) + F[1, 2]*pre(dphi) + F[1, 3]*cat(1, {pre(past[delay + 1])}, z_then);
    dphi = F[2, 1]*pre(phi) + F[2, 2]*pre(dphi) + F[2, 3]*cat(1, {pre(past[delay + 1])}, z_then);
    low = pre(low) + slow*(phi - pre(low));
    y_low = if f_h > 0 and not pre(begun) then y else pre(y_low) + slow*(y - pre(y_low));
    y_hat = phi*pre(theta);
    gate = if pre(begun) and abs(y_d - pre(y_d_last)) > 0 then 1 else 0;
    memory = Functions.adaptWeights(phi - low, y - y_low - (phi - low)*pre(theta), gate, pre(memory), cat(1, {w0}, w), sd, sigma, Ts/T, change, pause, Ts, box, w0_min);
    theta = Functions.lagged(memory, 3, n + 1);
    changes = memory[1];
    u = min(max(Functions.playsInverse(v, pre(u), pre(z), r, theta), u_min), u_max);
    z = Functions.play(u, r, pre(z));
    past = Functions.shift(u, pre(past));
    y_d_last = y_d;
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> y is the response to the last command, because the plant steps first. Before the start, the plant must be at rest at u0.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.BaseClasses.AdaptiveInverse\">Inverse.BaseClasses.AdaptiveInverse</a>: equation, source, example.</p>
</html>"));
end AdaptiveInverse;
