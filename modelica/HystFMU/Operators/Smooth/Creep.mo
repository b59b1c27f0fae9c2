within HystFMU.Operators.Smooth;
block Creep "Weighted sum of the input and its first-order lags, smooth"
  extends BaseClasses.Creep;
  extends Icons.Smooth;
  parameter Boolean inChain = false "Does nothing lead from y back to u? The start is then that of u alone" annotation (Dialog(group = "Start"));
  Real q[n] "Lagged inputs";
initial equation
  if not inChain then
    if start == Types.Start.steady then
      q = fill(u, n);
    else
      q = zeros(n);
    end if;
  end if;
equation
  // also an initial equation (Modelica 3.6, 8.6); rumoca 0.10.2 solves it behind an operator with events, but in no loop
  if inChain then
    when initial() then
      reinit(q, if start == Types.Start.steady then fill(u, n) else zeros(n));
    end when;
  end if;
  for i in 1:n loop
    T[i]*der(q[i]) = u - q[i];
  end for;
  y = w0*u + w*q;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> linear: the creep of an actuator follows its hysteresis.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.BaseClasses.Creep\">Operators.BaseClasses.Creep</a>: equation, source, example.</p>
</html>"));
end Creep;
