within HystFMU.Dynamics;
block StateSpace "Linear dynamics, discretised for the sample period"
  extends Icons.Block;
  extends Interfaces.Sampled;
  parameter Integer n(min = 1) = 1 "Order" annotation (Dialog(group = "Parameters"));
  parameter Real A[n, n] = 0.5*identity(n) "Weights of the state of the last step" annotation (Dialog(group = "Parameters"));
  parameter Real b_new[n] = fill(0.5, n) "Weights of the new input" annotation (Dialog(group = "Parameters"));
  parameter Real b_old[n] = fill(0.0, n) "Weights of the previous input; 0: the input is held" annotation (Dialog(group = "Parameters"));
  parameter Real c[n] = fill(1.0, n) "Output row" annotation (Dialog(group = "Parameters"));
  parameter Real d = 0 "Direct term" annotation (Dialog(group = "Parameters"));
  parameter Real x_steady[n] = fill(0.0, n) "Steady state at the input 1; 0: start from rest" annotation (Dialog(group = "Parameters"));
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y(start = 0, fixed = true) "Output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
protected
  discrete Real x[n](each start = 0, each fixed = true) "State";
  discrete Real u_last(start = 0, fixed = true) "Input at the last sample";
equation
  when sample(t0, Ts) then
    x = if not pre(begun) then x_steady*u else A*pre(x) + b_new*u + b_old*pre(u_last);
    u_last = u;
    y = c*x + d*u;
  end when;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> x_k = A x_(k-1) + b_new u_k + b_old u_(k-1), y_k = c x_k + d u_k.</p>
<p><b>Source:</b> Franklin, Powell &amp; Workman, Digital Control of Dynamic Systems, 3rd ed.; the matrices come from <code>hystfmu export --modelica</code>.</p>
<p><b>Limitations:</b> the matrices are valid for one value of Ts.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.StateSpace\">Validation.StateSpace</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.TransferFunction\">Dynamics.TransferFunction</a>.</p>
</html>"));
end StateSpace;
