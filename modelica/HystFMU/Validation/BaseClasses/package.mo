within HystFMU.Validation;
package BaseClasses "What the validation models have in common"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Test signals.</p>
</html>"));
end BaseClasses;
