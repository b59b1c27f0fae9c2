within HystFMU.Inverse;
package Models "Operators as static models, for the implicit inverse"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Each package contains an operator as a function of its input, last state and values. Inverse.Sampled.ImplicitInverse
uses one of these packages, or your own package that extends Inverse.BaseClasses.StaticModel.</p>
</html>"));
end Models;
