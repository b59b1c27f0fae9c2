package HystFMU "Hysteresis operators, their inverses, networks, plants and controllers"
  extends Icons.Package;
  annotation (
    version = "0.2.0",
    versionDate = "2026-11-26",
    versionBuild = 1,
    conversion(noneFromVersion = "0.1.0"),
    preferredView = "info",
    uses(),
    Documentation(info = "<html>
<p>Pure Modelica equations, no dependency: the library plugs into the blocks of the Modelica Standard Library as it is.
Every class that has a twin among the blocks of the HystFMU units carries the same names, units and defaults and is
compared with it numerically.</p>
<p>Operators and inverses come in up to three realisations with the same parameters: <em>Sampled</em> acts at 0, Ts, 2 Ts, ...,
exactly as a unit stepped with the communication step Ts; <em>Events</em> changes its memory where the input turns;
<em>Smooth</em> is an ordinary differential equation. See UsersGuide.Realisations.</p>
<p>Verified with rumoca 0.10.2, solver rk-like; every file is also read by the parser pymoca.</p>
</html>"));
end HystFMU;
