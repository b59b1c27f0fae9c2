within HystFMU.Dynamics;
block Creep "Weighted sum of first-order lags"
  extends Icons.Block;
  parameter Integer n(min = 1) = 1 "Number of lags";
  parameter Real w[n] = fill(1.0, n) "Weights of the lags";
  parameter Types.Time T[n](each min = 0) = fill(1.0, n) "Time constants, greater than 0";
  parameter Types.Start start = Types.Start.rest "Lags begin at 0, or at the first input";
  Interfaces.RealInput u "Input" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealOutput y "Output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  Real q[n] "Lagged inputs";
initial equation
  if start == Types.Start.steady then
    der(q) = zeros(n);
  else
    q = zeros(n);
  end if;
equation
  for i in 1:n loop
    T[i]*der(q[i]) = u - q[i];
  end for;
  y = w*q;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> q_i' = (u - q_i)/T_i, y = sum_i w_i q_i.</p>
<p><b>Source:</b> Krejci &amp; Kuhnen 2001: creep as a few lags.</p>
<p><b>Limitations:</b> continuous: the accuracy is the solver's. The unit of the same name discretises exactly.</p>
</html>"));
end Creep;
