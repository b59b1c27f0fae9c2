within HystFMU.UsersGuide;
package References "References"
  extends Icons.Information;
  annotation (preferredView = "info", DocumentationClass = true, Documentation(info = "<html>
<ul>
<li>Krejci, Kuhnen: Inverse control of systems with hysteresis and creep. IEE Proc. Control Theory Appl. 148 (2001) 185-192.</li>
<li>Zhao, Tan: Modeling hysteresis and its inverse model using neural networks based on expanded input space method. IEEE Trans. Control Syst. Technol. 16 (2008) 484-490.</li>
<li>Shen, Ma: constraint-factor hysteresis operator, 2017.</li>
<li>Yu, Alici: sliding mode control of a piezo actuator, 2005.</li>
<li>Levant: Sliding order and sliding accuracy in sliding mode control. Int. J. Control 58 (1993) 1247-1263.</li>
<li>Johnson: Accommodation of external disturbances in linear regulator and servomechanism problems. IEEE Trans. Autom. Control 16 (1971) 635-644.</li>
<li>Bristow, Tharayil, Alleyne: A survey of iterative learning control. IEEE Control Systems 26 (2006) 96-114.</li>
<li>Wen: Method for random vibration of hysteretic systems. J. Eng. Mech. Div. 102 (1976) 249-263.</li>
<li>Ikhouane, Rodellar: Systems with Hysteresis. Wiley 2007.</li>
<li>Coleman, Hodgdon: A constitutive relation for rate-independent hysteresis in ferromagnetically soft materials. Int. J. Eng. Sci. 24 (1986) 897-919.</li>
<li>Jiles, Atherton: Theory of ferromagnetic hysteresis. J. Magn. Magn. Mater. 61 (1986) 48-60.</li>
<li>Sadowski, Batistela, Bastos, Lajoie-Mazenc: An inverse Jiles-Atherton model to take into account hysteresis in time-stepping finite-element calculations. IEEE Trans. Magn. 38 (2002) 797-800.</li>
<li>Oh, Bernstein: Semilinear Duhem model. IEEE Trans. Autom. Control 50 (2005) 631-645.</li>
<li>Henon: On the numerical computation of Poincare maps. Physica D 5 (1982) 412-414.</li>
<li>Mayergoyz: Mathematical Models of Hysteresis. Springer 1991.</li>
<li>Krasnosel'skii, Pokrovskii: Systems with Hysteresis. Springer 1989.</li>
<li>Goldfarb, Celanovic: Modeling piezoelectric stack actuators. IEEE Control Systems 17 (1997) 69-79.</li>
<li>Noel, Schoukens: Hysteretic benchmark with a dynamic nonlinearity, 2016.</li>
</ul>
</html>"));
end References;
