within HystFMU;
package Inverse "Inverses of the operators"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>The inverses store the extrema of the wanted output and use inverse branch functions. For operators and models
without an inverse in closed form, Sampled.ImplicitInverse computes the input by root finding.</p>
</html>"));
end Inverse;
