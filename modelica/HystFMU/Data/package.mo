within HystFMU;
package Data "Identified models"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>The command <code>hystfmu export --modelica</code> writes these records from identified models. The first line of a file states that it is generated.</p>
</html>"));
end Data;
