within HystFMU;
package Validation "One model for each class"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Each model carries its own source and one component <em>tested</em>; its trajectory is compared with the unit of the same name.</p>
</html>"));
end Validation;
