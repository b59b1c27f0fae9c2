within HystFMU.Operators;
package Sampled "Operators that act at the instants k Ts"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>The semantics of a HystFMU unit stepped with Ts: no derivative of the input is needed, extrema between samples are not seen.</p>
</html>"));
end Sampled;
