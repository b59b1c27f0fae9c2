within HystFMU;
package Inverse "Inverses of the operators"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>The same list of extrema, driven by the output, with the inverse branch function.</p>
</html>"));
end Inverse;
