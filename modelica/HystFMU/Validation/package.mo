within HystFMU;
package Validation "One model for each class"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Each model contains a source and one component <em>tested</em>. Its result is compared with the unit of the same name.</p>
</html>"));
end Validation;
