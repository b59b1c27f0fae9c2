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
<p>The library consists of Modelica equations without dependencies. Its blocks can be connected to blocks of the
Modelica Standard Library. If a class corresponds to a block of the HystFMU units, names, units and defaults are the
same, and both are compared numerically.</p>
<p>Operators and inverses have up to three realisations with the same parameters. <em>Sampled</em> acts at 0, Ts, 2 Ts,
..., like a unit with the communication step Ts; <em>Events</em> changes its memory at reversals of the input;
<em>Smooth</em> is an ordinary differential equation. See UsersGuide.Realisations.</p>
<p>Verified with rumoca 0.10.2, solver rk-like; every file is also read by the parser pymoca.</p>
</html>"));
end HystFMU;
