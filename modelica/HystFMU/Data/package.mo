within HystFMU;
package Data "Identified models"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Records written from identified models by <code>hystfmu export --modelica</code>; a generated file says so in its first line.</p>
</html>"));
end Data;
