within HystFMU.Functions;
function observerGains "Gains of a third-order observer with three equal poles"
  extends Icons.Function;
  input Real F[3, 3] "Transition matrix; the first state is measured";
  input Real z "Pole";
  output Real M[3] "Gains from the prediction error to the states";
protected
  Real o_2[3] "Second row of the observability matrix of the predicted measurement: H F^2";
  Real o_3[3] "Third row of the observability matrix: H F^3";
  Real q[3] "Vector orthogonal to the first two rows of the observability matrix";
algorithm
  o_2 := F[1, :]*F;
  o_3 := o_2*F;
  q := {F[1, 2]*o_2[3] - F[1, 3]*o_2[2], F[1, 3]*o_2[1] - F[1, 1]*o_2[3], F[1, 1]*o_2[2] - F[1, 2]*o_2[1]};
  M := q/(q*o_3);
  for k in 1:3 loop
    M := F*M - z*M;
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> Ackermann's formula for (I - M H) F, H = (1 0 0): M = (F - z I)<sup>3</sup> O<sup>-1</sup> (0 0 1)', O = (H F; H F<sup>2</sup>; H F<sup>3</sup>).</p>
<p><b>Source:</b> Franklin, Powell &amp; Workman, Digital Control of Dynamic Systems, 3rd ed., section 8.2; poles in one place: Gao, ACC 2003.</p>
<p><b>Limitations:</b> the plant must be observable: a step must not be a multiple of half its period.</p>
<p><b>Example:</b> <code>observerGains(F, exp(-2*pi*f_o*Ts))</code> in <a href=\"modelica://HystFMU.Control.DisturbanceObserver\">Control.DisturbanceObserver</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.DisturbanceObserver\">Control.DisturbanceObserver</a>, which uses it.</p>
</html>"));
end observerGains;
