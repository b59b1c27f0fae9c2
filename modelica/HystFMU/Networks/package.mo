within HystFMU;
package Networks "Static networks"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Memoryless maps, trained elsewhere. They follow a hysteresis operator, which supplies the memory.</p>
</html>"));
end Networks;
