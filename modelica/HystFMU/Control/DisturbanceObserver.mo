within HystFMU.Control;
block DisturbanceObserver "Disturbance observer: subtracts an estimated input disturbance from the command"
  extends BaseClasses.DisturbanceObserver(u(start = 0, fixed = true), d_hat(start = 0, fixed = true));
  extends Interfaces.Sampled;
protected
  constant Real pi = 3.141592653589793 "Number pi";
  parameter Real F[3, 3] = Functions.observedStep(2*pi*f_n*Ts, zeta) "Transition matrix of position, velocity/omega_n, gain d";
  parameter Real M[3] = Functions.observerGains(F, exp(-2*pi*f_o*Ts)) "Observer gains";
  discrete Real ahead[3](each start = 0, each fixed = true) "Predicted position, velocity/omega_n, gain d";
  discrete Real estimate[3](each start = 0, each fixed = true) "Estimated position, velocity/omega_n, gain d";
  discrete Real past[n](each start = 0, each fixed = true) "Commands of the last n steps, newest first";
equation
  assert(abs(gain) > 0, "gain must not be 0");
  assert(u_min <= u_max, "u_min must not be greater than u_max");
  when sample(t0, Ts) then
    ahead = if not pre(begun) then {y, 0, 0} else F*(pre(estimate) + {0, 0, gain*pre(past[n])}) - {0, 0, gain*pre(past[n])};
    estimate = if not pre(begun) then ahead else ahead + M*(y - ahead[1]);
    d_hat = estimate[3]/gain;
    u = min(max(u_c - d_hat, u_min), u_max);
    past = Functions.shift(u, pre(past));
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> y is the response to the command n samples ago; without delay n = 1, because the plant steps first. Noise, and delay that is not included in n, limit f_o.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.BaseClasses.DisturbanceObserver\">Control.BaseClasses.DisturbanceObserver</a>: equation, source, example.</p>
</html>"));
end DisturbanceObserver;
