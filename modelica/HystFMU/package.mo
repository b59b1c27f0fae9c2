package HystFMU "Hysteresis operators, their inverses, networks, plants and controllers"
  annotation (
    version = "0.1.0",
    uses(),
    Documentation(info = "<html>
<p>Pure Modelica equations, no dependency: the library plugs into the blocks of the Modelica Standard Library as it is.
Every class that has a twin among the blocks of the HystFMU units carries the same names, units and defaults and is held
against it by numbers.</p>
<p>The operators are <em>sampled</em>: they take notice of their input at the instants 0, Ts, 2 Ts, ... and hold their
output in between, exactly as a unit stepped with the communication step Ts. The value at time 0 is the initialisation.</p>
<p>Verified with rumoca 0.10.2, solver rk-like; every file is also read by the parser pymoca.</p>
</html>"));
end HystFMU;
