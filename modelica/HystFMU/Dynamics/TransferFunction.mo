within HystFMU.Dynamics;
block TransferFunction "Linear transfer function of any order"
  extends BaseClasses.TransferFunction;
  extends Interfaces.InChain;
  Real v[na] "States: the derivatives 0 ... na - 1 of 1/a(s) u, in scaled time";
protected
  parameter Real sigma(unit = "1/s") = if abs(a[na + 1]) > 0 then abs(a[na + 1]/a[1])^(1/na) else 1 "Time scale";
  parameter Real alpha[na] = Functions.scaledDenominator(a, sigma) "Monic denominator in s/sigma, lowest power first";
  parameter Real d = if nb == na then b[1]/a[1] else 0 "Direct term";
  parameter Real c[na] = Functions.outputRow(b, a, sigma) "Output row";
  Real x[na] "States minus their initial values";
initial equation
  if start == Types.Start.steady and not inChain then
    der(x) = zeros(na);
  else
    x = zeros(na);
  end if;
equation
  assert(nb <= na, "the numerator must not have a higher degree than the denominator");
  assert(start == Types.Start.rest or abs(a[na + 1]) > 0, "start = steady: an integrator (last coefficient of a is 0) has no steady state");
  first = if start == Types.Start.steady and abs(a[na + 1]) > 0 then u/alpha[1] else 0;
  v[1] = if inChain then taken + x[1] else x[1];
  for i in 2:na loop
    v[i] = x[i];
  end for;
  for i in 1:na - 1 loop
    der(x[i]) = sigma*v[i + 1];
  end for;
  der(x[na]) = sigma*(u - alpha*v);
  // without direct term, u must not appear here: otherwise a loop through this block is algebraic
  y = if nb == na then c*v + d*u else c*v;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = (b_0 s<sup>nb</sup> + ... + b_nb)/(a_0 s<sup>na</sup> + ... + a_na) u, controllable canonical form in the scaled time s/sigma.</p>
<p><b>Source:</b> Franklin, Powell &amp; Workman, Digital Control of Dynamic Systems, 3rd ed.</p>
<p><b>Limitations:</b> the block is continuous; the solver determines its accuracy. The unit of the same name is discretised exactly. Its parameter hold has no meaning here.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.BaseClasses.TransferFunction\">Dynamics.BaseClasses.TransferFunction</a>: equation, source, example.</p>
</html>"));
end TransferFunction;
