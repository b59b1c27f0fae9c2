within HystFMU;
package Examples "Closed loops"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Ready loops. Each is the twin of a scenario of the same name.</p>
</html>"));
end Examples;
