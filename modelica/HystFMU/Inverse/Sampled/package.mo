within HystFMU.Inverse;
package Sampled "Inverses that act at the instants k Ts"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>The semantics of a HystFMU unit stepped with Ts.</p>
</html>"));
end Sampled;
