within HystFMU.Networks;
block RecursiveLeastSquares "Recursive least squares with a dead zone: learns the weights of regressors during operation"
  extends BaseClasses.RecursiveLeastSquares(y_hat(start = 0, fixed = true), theta(start = theta0, each fixed = true), learned(start = 0, fixed = true));
  extends Interfaces.Sampled;
protected
  discrete Real memory[3 + 3*n + div(n*(n - 1), 2)](start = cat(1, zeros(3), theta0, theta0, fill(eta, n), zeros(div(n*(n - 1), 2))), each fixed = true) "Number of updates, number of samples, sigma^2/r^2, weights, previous weights, D and U of P = U D U'";
equation
  when sample(t0, Ts) then
    memory = Functions.learnWeights(phi, y, pre(memory), form, mu, r, share);
    y_hat = phi*Functions.lagged(memory, 3 + n, n);
    theta = Functions.lagged(memory, 3, n);
    learned = memory[1];
  end when;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> an update that is not finite ends the simulation, while the unit resets P.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Networks.BaseClasses.RecursiveLeastSquares\">Networks.BaseClasses.RecursiveLeastSquares</a>: equation, source, example.</p>
</html>"));
end RecursiveLeastSquares;
