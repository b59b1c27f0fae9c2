within HystFMU.Inverse;
package Models "Operators as static models, for the implicit inverse"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Each package holds an operator as a function of its input, its state before and its values. Inverse.Sampled.ImplicitInverse takes one of
them, or one of your own that extends Inverse.BaseClasses.StaticModel.</p>
</html>"));
end Models;
