within HystFMU.Validation;
package BaseClasses "Base classes of the validation models"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Test signals.</p>
</html>"));
end BaseClasses;
