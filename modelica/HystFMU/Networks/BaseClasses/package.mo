// generated from the C tables by `make generate` - do not edit
within HystFMU.Networks;
package BaseClasses "Parameters and ports of the blocks"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>What a class has from the C table, and what its realisations have in common, for replaceable components to be constrained by.</p>
</html>"));
end BaseClasses;
