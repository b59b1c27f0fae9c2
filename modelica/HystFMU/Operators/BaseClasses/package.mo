within HystFMU.Operators;
package BaseClasses "Parameters and ports of the operators"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>What the realisations of an operator have in common: the constraining classes for redeclaration.</p>
</html>"));
end BaseClasses;
