within HystFMU.Functions;
function learnWeights "Weights of recursive least squares and the factors of P after a sample"
  extends Icons.Function;
  input Real phi[:] "Regressors";
  input Real y "Measured output";
  input Real memory[:] "Number of updates, number of samples, sigma^2/r^2, weights, previous weights, D, columns of U above the diagonal";
  input Types.Recursion form "Form";
  input Real mu "Forgetting factor";
  input Real r "Dead zone";
  input Real share "Gain relative to its bound";
  output Real memory_new[size(memory, 1)] "Memory after the sample";
protected
  Integer n = size(phi, 1);
  Integer at "Index in memory before the column of U";
  Real e = y "Error before the update";
  Real f "Element of U' phi";
  Real v "Element of D U' phi";
  Real u "Element of U";
  Real leverage = 0 "phi' P phi";
  Real excess "share (e^2 - r^2)/r^2";
  Real old "alpha before the column";
  Real alpha "alpha_0 plus the sum for phi' P phi up to the column";
  Real gain[size(phi, 1)] "P phi";
algorithm
  memory_new := memory;
  gain := zeros(n);
  for i in 1:n loop
    e := e - phi[i]*memory[3 + i];
    memory_new[3 + n + i] := memory[3 + i];
  end for;
  at := 3 + 3*n;
  for j in 1:n loop
    f := phi[j];
    for i in 1:j - 1 loop
      f := f + memory[at + i]*phi[i];
    end for;
    leverage := leverage + memory[3 + 2*n + j]*f*f;
    at := at + j - 1;
  end for;
  memory_new[2] := memory[2] + 1;
  memory_new[3] := memory[3] + (if form == Types.Recursion.printed then (e/r)*(e/r)/memory_new[2] else 0);
  excess := share*((if form == Types.Recursion.printed then memory_new[3] else (e/r)*(e/r)) - 1);
  if form == Types.Recursion.plain or abs(e) > r and abs(excess) > 0 and abs(leverage) > 0 then
    alpha := if form == Types.Recursion.plain then mu else leverage/excess;
    at := 3 + 3*n;
    for j in 1:n loop
      f := phi[j];
      for i in 1:j - 1 loop
        f := f + memory[at + i]*phi[i];
      end for;
      v := memory[3 + 2*n + j]*f;
      old := alpha;
      alpha := alpha + f*v;
      for i in 1:j - 1 loop
        u := memory[at + i];
        memory_new[at + i] := u - f/old*gain[i];
        gain[i] := gain[i] + u*v;
      end for;
      gain[j] := v;
      memory_new[3 + 2*n + j] := memory[3 + 2*n + j]*(old/alpha)/mu;
      at := at + j - 1;
    end for;
    for i in 1:n loop
      memory_new[3 + i] := memory[3 + i] + gain[i]/alpha*e;
    end for;
    memory_new[1] := memory[1] + 1;
  elseif form == Types.Recursion.printed then
    for j in 1:n loop
      memory_new[3 + 2*n + j] := memory[3 + 2*n + j]/mu;
    end for;
  end if;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> theta += P phi e/(alpha_0 + phi' P phi), P = (P - P phi phi' P/(alpha_0 + phi' P phi))/mu; alpha_0 = mu without dead zone, phi' P phi/excess with it; P = U D U', U unit upper triangular.</p>
<p><b>Source:</b> Bierman, Automatica 12 (1976) 375; IPMC hysteresis model with basis function network, eq. 13-19.</p>
<p><b>Limitations:</b> none.</p>
<p><b>Example:</b> <code>learnWeights(phi, y, pre(memory), form, mu, r, share)</code> in <a href=\"modelica://HystFMU.Networks.RecursiveLeastSquares\">Networks.RecursiveLeastSquares</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Networks.RecursiveLeastSquares\">Networks.RecursiveLeastSquares</a>, which uses it.</p>
</html>"));
end learnWeights;
