// generated from modelica/validation.toml by `make generate` - do not edit
within HystFMU.Validation;
model RecursiveLeastSquaresPrinted "Dead zone as printed"
  extends Icons.Example;
  Networks.RecursiveLeastSquares tested(n = 3, theta0 = {0.2, 0, -0.1}, eta = 4, mu = 0.99, r = 0.2, share = 0.75, form = Types.Recursion.printed, Ts = 0.01) annotation (Placement(transformation(extent = {{-20, -20}, {20, 20}})));
equation
  tested.phi[1] = sin(7*time);
  tested.phi[2] = cos(11*time) - 0.3;
  tested.phi[3] = 1;
  tested.y = 0.8*sin(7*time) - 0.5*cos(11*time) + 0.35 + 0.05*sin(90*time);
  annotation (experiment(StopTime = 1.1, Interval = 0.01, Tolerance = 1e-10),
    Documentation(info = "<html>
<p>Dead zone as printed. The test compares it with the unit at every sample.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Networks.RecursiveLeastSquares\">Networks.RecursiveLeastSquares</a>.</p>
</html>"));
end RecursiveLeastSquaresPrinted;
