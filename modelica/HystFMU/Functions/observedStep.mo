within HystFMU.Functions;
function observedStep "Transition matrix of a second-order plant with a constant disturbance"
  extends Icons.Function;
  input Real p "Step multiplied by omega_n, less than 1e6";
  input Real zeta "Damping ratio";
  output Real F[3, 3] "Exponential of {{0, p, 0}, {-p, -2 zeta p, p}, {0, 0, 0}}";
protected
  constant Integer most = 40 "Halvings";
  Real A[3, 3] "The matrix, halved until its norm is at most 1/8";
  Real norm = p*(2 + 2*zeta);
  Integer squarings = 0;
algorithm
  for i in 1:most loop
    if norm > 0.125 then
      norm := 0.5*norm;
      squarings := squarings + 1;
    end if;
  end for;
  A := [0, p, 0; -p, -2*zeta*p, p; 0, 0, 0]/2^squarings;
  // Taylor series by Horner's rule, remainder below 1e-20
  F := identity(3);
  for k in 1:12 loop
    F := identity(3) + A*F/(13 - k);
  end for;
  for i in 1:most loop
    if i <= squarings then
      F := F*F;
    end if;
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> F = e<sup>A</sup> = (e<sup>A/2^s</sup>)<sup>2^s</sup>; states: position, velocity/omega_n, gain times disturbance.</p>
<p><b>Source:</b> scaling and squaring: Moler &amp; Van Loan, SIAM Review 45 (2003) 3, section 3.</p>
<p><b>Limitations:</b> each squaring may double the rounding error, so a step must not be longer than some time
constants of the plant. The loops have a fixed length, because rumoca 0.10.2 supports no while loop whose end depends on
data.</p>
<p><b>Example:</b> <code>observedStep(2*pi*f_n*Ts, zeta)</code> in <a href=\"modelica://HystFMU.Control.DisturbanceObserver\">Control.DisturbanceObserver</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.DisturbanceObserver\">Control.DisturbanceObserver</a>, <a href=\"modelica://HystFMU.Inverse.AdaptiveInverse\">Inverse.AdaptiveInverse</a>, which use it.</p>
</html>"));
end observedStep;
