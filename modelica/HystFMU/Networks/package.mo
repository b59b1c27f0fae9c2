within HystFMU;
package Networks "Static networks"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Networks without memory, trained outside Modelica. They follow a hysteresis operator, which contains the memory.</p>
</html>"));
end Networks;
