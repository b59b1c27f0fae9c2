within HystFMU.Validation;
package Events "Operators and inverses with events at reversals"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Each compares one class with the C core of the units and an independent form, on the same signal.</p>
</html>"));
end Events;
