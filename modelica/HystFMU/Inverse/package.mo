within HystFMU;
package Inverse "Inverses of the operators"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>The same list of extrema, driven by the output, with the inverse branch function. For operators and models without an
inverse in closed form, Sampled.ImplicitInverse finds the input by bounded root search.</p>
</html>"));
end Inverse;
