within HystFMU.Control;
block DisturbanceObserver "Disturbance observer: takes an estimated input disturbance off the command"
  extends Icons.Block;
  extends Interfaces.Sampled;
  parameter Types.Frequency f_n(min = 0) = 1 "Natural frequency of the plant";
  parameter Real zeta(min = 0) = 0.7 "Damping ratio of the plant";
  parameter Real gain = 1 "Gain of the plant at rest, not 0";
  parameter Types.Frequency f_o(min = 0) = 0.5 "Bandwidth of the observer";
  parameter Real u_min = -1e300 "Lower limit of u";
  parameter Real u_max = 1e300 "Upper limit of u";
  Interfaces.RealInput u_c "Command that an undisturbed plant would get" annotation (Placement(transformation(extent = {{-120, 50}, {-100, 70}})));
  Interfaces.RealInput y "Measured output of the plant" annotation (Placement(transformation(extent = {{-120, -70}, {-100, -50}})));
  Interfaces.RealOutput u(start = 0, fixed = true) "Command without the estimated disturbance" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  Interfaces.RealOutput d_hat(start = 0, fixed = true) "Estimated disturbance at the input of the plant" annotation (Placement(transformation(extent = {{100, -70}, {120, -50}})));
protected
  constant Real pi = 3.141592653589793 "Half a turn";
  parameter Real F[3, 3] = Functions.observedStep(2*pi*f_n*Ts, zeta) "Position, velocity/omega_n, gain d over a step";
  parameter Real M[3] = Functions.observerGains(F, exp(-2*pi*f_o*Ts)) "Gains of the measurement";
  discrete Real ahead[3](each start = 0, each fixed = true) "Position, velocity/omega_n, gain d as predicted";
  discrete Real estimate[3](each start = 0, each fixed = true) "The same as estimated";
equation
  assert(abs(gain) > 0, "gain must not be 0");
  assert(u_min <= u_max, "u_min must not be greater than u_max");
  when sample(0, Ts) then
    ahead = if time < 0.5*Ts then {y, 0, 0} else F*(pre(estimate) + {0, 0, gain*pre(u)}) - {0, 0, gain*pre(u)};
    estimate = if time < 0.5*Ts then ahead else ahead + M*(y - ahead[1]);
    d_hat = estimate[3]/gain;
    u = min(max(u_c - d_hat, u_min), u_max);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> u = u_c - d_hat; d_hat: observer of y'' = omega_n<sup>2</sup> (gain (u + d) - y) - 2 zeta omega_n y', d' = 0, poles at exp(-2 pi f_o Ts), omega_n = 2 pi f_n.</p>
<p><b>Source:</b> Ohnishi 1987; Johnson, IEEE Trans. Automat. Control 16 (1971) 635; poles: Gao, ACC 2003.</p>
<p><b>Limitations:</b> y is what the last command led to: the plant steps before. Delay and noise bound f_o. The simulation must start at time 0.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.PidObserver\">Examples.PidObserver</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.Pid\">Control.Pid</a>, <a href=\"modelica://HystFMU.Control.LeadLag\">Control.LeadLag</a>, <a href=\"modelica://HystFMU.Validation.DisturbanceObserver\">Validation.DisturbanceObserver</a>.</p>
</html>"));
end DisturbanceObserver;
