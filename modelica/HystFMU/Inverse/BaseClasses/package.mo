within HystFMU.Inverse;
package BaseClasses "Parameters and ports of the inverses"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>What the realisations of an inverse have in common: the constraining classes for redeclaration.</p>
</html>"));
end BaseClasses;
