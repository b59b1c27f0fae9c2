within HystFMU.Validation;
package Sampled "Operators and inverses at instants k Ts"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Each compares one class with the C core of the units and an independent form, on the same signal.</p>
</html>"));
end Sampled;
