within HystFMU.Control;
block IterativeLearning "Iterative learning control: corrections from the errors of earlier periods"
  extends Icons.Block;
  extends Interfaces.Sampled;
  parameter Integer n(min = 1) = 20 "Steps in a period of the reference";
  parameter Real gain = 0.5 "Share of an error that is learnt";
  parameter Integer lead(min = 0, max = 1000000) = 1 "Steps from a command to its effect";
  parameter Real smooth(min = 0, max = 0.25) = 0 "Weight of each neighbour in the filter; 0: none";
  parameter Real u_min = -1e300 "Lower limit of u";
  parameter Real u_max = 1e300 "Upper limit of u";
  Interfaces.RealInput y_d "Reference" annotation (Placement(transformation(extent = {{-120, 50}, {-100, 70}})));
  Interfaces.RealInput y "Measured output of the plant" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput u_ff "Feed-forward, or command of another controller" annotation (Placement(transformation(extent = {{-120, -70}, {-100, -50}})));
  Interfaces.RealOutput u(start = 0, fixed = true) "Control" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  discrete Real period[2 + 2*n](start = cat(1, {-1}, zeros(1 + 2*n)), each fixed = true) "Present step, its correction, corrections over the period, errors of this period";
equation
  assert(u_min <= u_max, "u_min must not be greater than u_max");
  when sample(0, Ts) then
    period = Functions.learn(y_d - y, pre(period), gain, lead, smooth);
    u = min(max(u_ff + period[2], u_min), u_max);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> u_k = u_ff + w_k; after each period w_k &larr; Q (w_k + gain e_(k + lead)), e = y_d - y,
Q w_k = smooth w_(k-1) + (1 - 2 smooth) w_k + smooth w_(k+1).</p>
<p><b>Source:</b> Arimoto, Kawamura &amp; Miyazaki 1984; Bristow, Tharayil &amp; Alleyne, IEEE Control Systems 26 (2006) 96.</p>
<p><b>Limitations:</b> the period of the reference must be n Ts; what does not repeat is not learnt. The time of a step grows with n. The simulation must start at time 0.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.IterativeLearning\">Examples.IterativeLearning</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.Feedforward\">Control.Feedforward</a>, <a href=\"modelica://HystFMU.Validation.IterativeLearning\">Validation.IterativeLearning</a>.</p>
</html>"));
end IterativeLearning;
