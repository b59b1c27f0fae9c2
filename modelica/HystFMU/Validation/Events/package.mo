within HystFMU.Validation;
package Events "Operators and inverses with events at reversals"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Each model simulates one class. The result is compared with the C core of the units and an independent implementation for the same signal.</p>
</html>"));
end Events;
