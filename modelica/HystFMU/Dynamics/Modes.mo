within HystFMU.Dynamics;
block Modes "Second-order modes in parallel"
  extends BaseClasses.Modes;
  Real q[n](each start = 0, each fixed = true) "Displacements of the modes, not multiplied by k";
  Real v[n](each start = 0, each fixed = true) "Velocities of the modes / omega";
protected
  parameter Real omega[n](each unit = "rad/s") = 6.283185307179586*f_n "Natural angular frequencies";
equation
  for i in 1:n loop
    der(q[i]) = omega[i]*v[i];
    der(v[i]) = omega[i]*(u - q[i] - 2*zeta[i]*v[i]);
  end for;
  y = k*q;
  annotation (Documentation(info = "<html>
<p><b>Limitations:</b> the block is continuous; the solver determines its accuracy. The unit of the same name is exact if the input is held over a step.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Dynamics.BaseClasses.Modes\">Dynamics.BaseClasses.Modes</a>: equation, source, example.</p>
</html>"));
end Modes;
