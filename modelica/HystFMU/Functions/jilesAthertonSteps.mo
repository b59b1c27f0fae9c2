within HystFMU.Functions;
function jilesAthertonSteps "Twenty steps of the Jiles-Atherton operator with moving walls"
  extends Icons.Function;
  input Real before[2] "Effective field and distance of the walls from the anhysteretic curve";
  input Real u "Field at the end of all steps";
  input Real s "Direction, 1 or -1";
  input Real Ms "Saturation";
  input Real a "Shape";
  input Real k "Pinning";
  input Real c "Reversible share";
  input Real alpha "Mean field for a magnetisation of 1";
  input Real steps "Number of steps per field of length min(a, k)";
  output Real after[2] "Effective field and distance after the steps";
algorithm
  after := before;
  for i in 1:20 loop
    if s*(u - after[1] + alpha*(Ms*langevin(after[1]/a) - (1 - c)*after[2])) > 1e-14*(abs(u) + a) then
      after := jilesAthertonStep(after, u, s, Ms, a, k, c, alpha, steps);
    end if;
  end for;
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> repeats jilesAthertonStep until h - alpha y = u.</p>
<p><b>Source:</b> Jiles &amp; Atherton, J. Magn. Magn. Mater. 61 (1986) 48-60.</p>
<p><b>Limitations:</b> always twenty steps, because the loops of rumoca 0.10.2 have a fixed length.</p>
<p><b>Example:</b> <code>jilesAthertonSteps(after, u, s, Ms, a, k, c, alpha, steps)</code> in <a href=\"modelica://HystFMU.Functions.jilesAthertonManySteps\">Functions.jilesAthertonManySteps</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.jilesAthertonManySteps\">Functions.jilesAthertonManySteps</a>, which uses it.</p>
</html>"));
end jilesAthertonSteps;
