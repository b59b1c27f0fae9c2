within HystFMU.Operators;
block BoucWen "Bouc-Wen operator"
  extends Interfaces.Sampled;
  parameter Real A(min = 1e-100, max = 1e100) = 1 "Slope of z at z = 0";
  parameter Real beta(min = 0, max = 1e100) = 0.5 "Width of the loop";
  parameter Real gamma(min = -1e100, max = 1e100) = 0.5 "Shape of the loop; beta + gamma > 0";
  parameter Real n(min = 1, max = 20) = 1 "Sharpness of the knee";
  parameter Real alpha(min = 0, max = 1) = 0.5 "Share of the linear term";
  parameter Real k = 1 "Output gain";
  parameter Real z0 = 0 "z at the first input; within z_max";
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y(start = 0, fixed = true) "Output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  Interfaces.RealOutput z(start = z0, fixed = true) "Hysteretic part" annotation (Placement(transformation(extent = {{100, -70}, {120, -50}})));
protected
  discrete Real u_last(start = 0, fixed = true) "Input at the last sample";
equation
  assert(beta + gamma > 0, "beta + gamma must be greater than 0: z would grow without bound");
  assert((beta + gamma)*abs(z0)^n <= A, "z0 must be within (A/(beta + gamma))^(1/n), the bound of z");
  when sample(0, Ts) then
    z = if time < 0.5*Ts then z0 else Functions.boucWen(u, pre(u_last), pre(z), A, beta, gamma, n);
    u_last = u;
    y = k*(alpha*u + (1 - alpha)*z);
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> z' = A u' - beta abs(u') abs(z)<sup>n-1</sup> z - gamma u' abs(z)<sup>n</sup>, y = k (alpha u + (1 - alpha) z), integrated in u: the operator does not depend on the rate.</p>
<p><b>Source:</b> Wen, J. Eng. Mech. Div. 102 (1976) 249-263; Ikhouane &amp; Rodellar, Systems with Hysteresis, 2007, chapter 2.</p>
<p><b>Limitations:</b> exact for n = 1; for other n twenty Runge-Kutta steps for each sample. The simulation must start at time 0.</p>
</html>"));
end BoucWen;
