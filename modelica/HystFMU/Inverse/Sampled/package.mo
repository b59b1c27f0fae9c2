within HystFMU.Inverse;
package Sampled "Inverses that act at the instants k Ts"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>The blocks behave like HystFMU units with the step Ts.</p>
</html>"));
end Sampled;
